"""Angles wrapped to (-pi, pi]."""

import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_msgs_py.angles import angle_difference, wrap_angle

ANGLES = st.floats(min_value=-50.0, max_value=50.0)


@pytest.mark.parametrize(
    ('angle', 'wrapped'),
    [(0.0, 0.0), (math.pi, math.pi), (-math.pi, math.pi), (1.5 * math.pi, -0.5 * math.pi)],
)
def test_wraps_known_angles(angle: float, wrapped: float) -> None:
    assert wrap_angle(angle) == pytest.approx(wrapped)


@given(ANGLES)
def test_wrapped_angle_points_the_same_way(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@given(ANGLES, ANGLES)
def test_difference_leads_from_one_to_the_other(to: float, start: float) -> None:
    turned = wrap_angle(start + angle_difference(to, start))
    assert abs(angle_difference(turned, to)) < 1e-9


def test_shortest_turn_crosses_zero() -> None:
    assert angle_difference(math.radians(10), math.radians(350)) == pytest.approx(math.radians(20))
