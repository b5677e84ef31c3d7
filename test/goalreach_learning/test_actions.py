import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_learning.policy import action_directions, action_headings_rad, nearest_action
from goalreach_msgs_py.angles import angle_difference


def test_are_the_eight_headings_of_the_paper() -> None:
    expected_deg = [0, 45, 90, 135, 180, -135, -90, -45]
    assert [math.degrees(a) for a in action_headings_rad(8)] == pytest.approx(expected_deg)


@pytest.mark.parametrize('count', [4, 8, 16])
def test_directions_point_along_the_headings(count: int) -> None:
    directions, headings_rad = action_directions(count), action_headings_rad(count)
    for (x, y), heading in zip(directions, headings_rad, strict=True):
        assert (x, y) == pytest.approx((math.cos(heading), math.sin(heading)), abs=1e-15)
    # exact: a robot along a wall stays along it
    assert directions[3 * count // 4] == (0.0, -1.0)
    assert directions[count // 2] == (-1.0, 0.0)


def test_nearest_action_wraps_around() -> None:
    assert nearest_action(math.radians(-50), 8) == 7
    assert nearest_action(math.radians(340), 8) == 0
    assert nearest_action(math.radians(-170), 8) == 4


@given(st.floats(-10.0, 10.0), st.sampled_from([4, 8, 16]))
def test_nearest_action_is_within_half_a_step(heading_rad: float, count: int) -> None:
    found = action_headings_rad(count)[nearest_action(heading_rad, count)]
    assert abs(angle_difference(found, heading_rad)) <= math.pi / count + 1e-9
