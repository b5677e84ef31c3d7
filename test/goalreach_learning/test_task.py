import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_learning.task import (
    ACTION_DIRECTIONS,
    ACTION_HEADINGS_RAD,
    ACTIONS_DEG,
    nearest_action,
)
from goalreach_msgs_py.angles import angle_difference


def test_are_the_eight_headings_of_the_paper() -> None:
    assert ACTIONS_DEG == (0, 45, 90, 135, 180, 225, 270, 315)


def test_directions_point_along_the_headings() -> None:
    for (x, y), heading in zip(ACTION_DIRECTIONS, ACTION_HEADINGS_RAD, strict=True):
        assert (x, y) == pytest.approx((math.cos(heading), math.sin(heading)), abs=1e-15)
    assert ACTION_DIRECTIONS[6] == (0.0, -1.0)  # exact: a robot along a wall stays along it


def test_nearest_action_wraps_around() -> None:
    assert nearest_action(math.radians(-50)) == 7
    assert nearest_action(math.radians(340)) == 0
    assert nearest_action(math.radians(-170)) == 4


@given(st.floats(-10.0, 10.0))
def test_nearest_action_is_within_half_a_step(heading_rad: float) -> None:
    found = ACTION_HEADINGS_RAD[nearest_action(heading_rad)]
    assert abs(angle_difference(found, heading_rad)) <= math.pi / 8 + 1e-9
