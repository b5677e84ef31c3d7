import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.steering import STANDING, HeadingFollower, cruise_fraction, steering_rate
from goalreach_msgs_py.values import Pose2

CONFIG = ControllerConfig(cruise_speed_m_per_s=0.5)


def rate(error_rad: float) -> float:
    config = ControllerConfig(
        heading_gain_per_s=3.0, steering_limit_rad_per_s=1.0, steering_braking_rad_per_s2=0.9
    )
    return steering_rate(error_rad, config)


def test_is_proportional_near_zero() -> None:
    assert rate(0.05) == pytest.approx(0.15)
    assert rate(-0.1) == pytest.approx(-0.3)  # up to a / gain^2 = 0.1


def test_follows_the_braking_curve_farther_out() -> None:
    assert rate(0.3) == pytest.approx(math.sqrt(2 * 0.9 * 0.25))
    assert rate(3.0) == 1.0


@given(st.floats(-3.1, 3.1))
def test_can_always_stop_in_time(error_rad: float) -> None:
    assert rate(error_rad) ** 2 <= 2 * 0.9 * abs(error_rad) + 1e-12
    assert rate(error_rad) * error_rad >= 0.0


def test_slows_with_the_heading_error() -> None:
    stop = math.radians(60)
    assert cruise_fraction(0.0, stop) == 1.0
    assert cruise_fraction(math.acos(0.75), stop) == pytest.approx(0.5)
    assert cruise_fraction(stop, stop) == pytest.approx(0.0)
    assert cruise_fraction(-2.0, stop) == 0.0


def pose(heading_deg: float) -> Pose2:
    return Pose2(x_m=1.0, y_m=1.0, heading_rad=math.radians(heading_deg))


def test_turns_on_the_spot_before_it_drives() -> None:
    follower = HeadingFollower()
    assert follower.command(pose(0), CONFIG) == STANDING
    follower.turn_to(math.radians(20))
    turning = follower.command(pose(0), CONFIG)
    assert turning.linear_m_per_s == 0.0
    assert turning.steering_rad_per_s > 0.0
    assert follower.command(pose(19.5), CONFIG).linear_m_per_s == pytest.approx(0.5, rel=1e-3)
    assert follower.command(pose(10), CONFIG).linear_m_per_s > 0.4  # it has been on course


def test_turning_to_another_heading_stops_and_steering_does_not() -> None:
    follower = HeadingFollower()
    follower.turn_to(0.0)
    follower.command(pose(0), CONFIG)
    follower.steer_to(math.radians(10))
    assert follower.command(pose(0), CONFIG).linear_m_per_s > 0.4
    follower.turn_to(math.radians(10))  # the same heading: no stop
    assert follower.command(pose(0), CONFIG).linear_m_per_s > 0.4
    follower.turn_to(math.radians(45))
    assert follower.command(pose(0), CONFIG).linear_m_per_s == 0.0
