"""What repeated measurements come to."""

import pytest

from goalreach_lab.speed.budget import Budget
from goalreach_lab.speed.samples import fit_line, percentile, spread


def test_a_line_through_points_that_are_none() -> None:
    line = fit_line([0.0, 1.0, 2.0, 3.0], [1.0, 1.0, 3.0, 3.0])
    assert line.slope == pytest.approx(0.8)
    assert line.start == pytest.approx(0.8)
    assert line.r_squared == pytest.approx(0.8)


def test_a_level_line_explains_all() -> None:
    assert fit_line([1.0, 2.0], [5.0, 5.0]) == (5.0, 0.0, 1.0)


def test_percentiles() -> None:
    assert percentile([1.0, 2.0, 3.0], 50.0) == 2.0
    assert percentile([0.0, 100.0], 99.0) == 99.0


def test_spread_of_both() -> None:
    assert spread([2.0, 1.0]) == 'from 1 to 2'
    assert spread([2.0, 1.0], [0.5]) == 'from 1 to 2; reference from 0.5 to 0.5'


def test_a_budget_scales_and_leaves_something() -> None:
    small, whole = Budget(seed=0, scale=0.01), Budget(seed=0, scale=1.0)
    assert (whole.count(500), small.count(500), small.count(7)) == (500, 5, 1)
    assert (whole.seconds(6.0), small.seconds(6.0)) == (6.0, 0.5)
    assert small.count(500, 44) == 44
