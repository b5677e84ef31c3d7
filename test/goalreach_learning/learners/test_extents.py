"""Extents of regions, by hand: what is learned where a robot is, and where it left a region."""

import pytest

from goalreach_learning.learners.planner import BORDER_M, Extents


def test_a_place_extends_its_column_and_row() -> None:
    extents = Extents()
    extents.enter((0, 2), (0.5, 4.0))
    extents.enter((0, 2), (0.3, 4.5))
    assert extents.spans_m == ({0: (0.3, 0.5)}, {2: (4.0, 4.5)})


def test_a_place_belongs_to_no_other_column() -> None:
    """The border is near 1.2: what was taken for column 0 beyond it, is taken back."""
    extents = Extents()
    extents.enter((0, 0), (0.5, 0.5))
    extents.enter((0, 0), (1.9, 0.5))
    extents.enter((1, 0), (1.3, 0.5))
    assert extents.spans_m[0] == {0: (0.5, 1.3), 1: (1.3, 1.3)}
    extents.enter((0, 0), (1.1, 0.5))
    assert extents.spans_m[0] == {0: (0.5, 1.3), 1: (1.3, 1.3)}


def test_a_region_extends_to_the_border_at_which_it_was_left() -> None:
    extents = Extents()
    extents.enter((0, 1), (0.5, 2.0))
    extents.leave((0, 1), (1, 1), (1.25, 2.1))
    assert extents.spans_m == ({0: (0.5, 1.25)}, {1: (2.0, 2.1)})


@pytest.mark.parametrize(
    ('after', 'at_m'),
    [
        ((1, 0), (1.5, 0.8)),  # the goal, declared well inside the row that begins at 1.7
        ((1, 3), (1.5, 4.9)),  # an estimate that jumped over a row
    ],
)
def test_nothing_is_learned_of_a_border_that_is_not_near(
    after: tuple[int, int], at_m: tuple[float, float]
) -> None:
    extents = Extents()
    extents.enter((1, 0), (1.5, 0.4))
    extents.enter((1, 0), (1.5, 1.7))
    extents.enter((1, 1), (1.5, 2.0))
    extents.leave((1, 1), after, at_m)
    assert extents.spans_m[1] == {0: (0.4, 1.7), 1: (2.0, 2.0)}
    extents.leave((1, 1), (1, 0), (1.5, 1.7 - 0.9 * BORDER_M))
    assert extents.spans_m[1][1] == pytest.approx((1.52, 2.0))
