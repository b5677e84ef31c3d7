from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from goalreach_msgs_py.regions import memberships

KNOTS = (0.0, 1.0, 3.0, 5.0, 7.0, 8.0)


@pytest.mark.parametrize(
    ('value', 'expected'),
    [
        (-1.0, (1.0, 0.0, 0.0)),
        (0.0, (1.0, 0.0, 0.0)),
        (1.0, (1.0, 0.0, 0.0)),
        (2.0, (0.5, 0.5, 0.0)),
        (2.5, (0.25, 0.75, 0.0)),
        (3.0, (0.0, 1.0, 0.0)),
        (4.0, (0.0, 1.0, 0.0)),
        (5.0, (0.0, 1.0, 0.0)),
        (5.5, (0.0, 0.75, 0.25)),
        (7.0, (0.0, 0.0, 1.0)),
        (9.0, (0.0, 0.0, 1.0)),
    ],
)
def test_memberships_at_and_between_the_knots(
    value: float, expected: tuple[float, float, float]
) -> None:
    assert memberships(value, KNOTS) == expected


def test_a_transition_without_width_is_a_crisp_border() -> None:
    crisp = (0.0, 2.0, 2.0, 5.0, 5.0, 8.0)
    assert memberships(1.999, crisp) == (1.0, 0.0, 0.0)
    assert memberships(2.0, crisp) == (0.0, 1.0, 0.0)
    assert memberships(4.999, crisp) == (0.0, 1.0, 0.0)
    assert memberships(5.0, crisp) == (0.0, 0.0, 1.0)


@given(st.floats(-2.0, 10.0), st.lists(st.floats(0.0, 8.0), min_size=6, max_size=6))
@settings(max_examples=200, deadline=None)
def test_memberships_sum_to_one_and_are_never_three(value: float, knots: list[float]) -> None:
    mu = memberships(value, sorted(knots))
    assert sum(mu) == pytest.approx(1.0)
    assert all(0.0 <= m <= 1.0 for m in mu)
    assert min(mu[0], mu[2]) == 0.0
