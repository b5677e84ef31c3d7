import pytest

from goalreach_evaluation.path_metrics import wilson_interval
from goalreach_lab.reproduction.learning import (
    SETTLED,
    SUCCESS,
    VALUES,
    Options,
    execute,
    settled_after,
)
from goalreach_msgs_py.errors import ConfigurationError


def test_wilson_interval_by_hand() -> None:
    # z^2 = 3.8415: centre (0.5 + 0.19207) / 1.38415, half 1.96 sqrt(0.025 + 0.0096) / 1.38415
    assert wilson_interval(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-4)
    assert wilson_interval(10, 10) == pytest.approx((0.7225, 1.0), abs=1e-4)


def test_settled_after() -> None:
    assert settled_after([True, True, True]) == 1
    assert settled_after([False, True, False, True]) == 4
    assert settled_after([True, False]) == 3  # not within the two


def test_rows_of_a_small_study() -> None:
    by_name = {row.name: row for row in execute(Options(seeds=40, variation_seeds=5))}
    success = by_name[SUCCESS]
    assert (success.ours, success.n, success.met) == (100.0, 40, True)
    assert 1 <= by_name[SETTLED].ours <= 10
    assert 0.0 < by_name[VALUES].ours < 0.05
    assert sum(name.startswith('with ') for name in by_name) == 9


def test_refuses_no_seeds() -> None:
    with pytest.raises(ConfigurationError, match='--seeds = 0'):
        Options(seeds=0)
