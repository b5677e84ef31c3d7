"""Heading control: speed and steering rate within the limits of the drive."""

from dataclasses import dataclass
import math

from goalreach_learning.controller_config import ControllerConfig
from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.values import Pose2, Twist2

STANDING = Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)


def steering_rate(error_rad: float, config: ControllerConfig) -> float:
    """Return the steering rate that removes a heading error without overshoot, rad/s.

    Proportional near zero; for larger errors the rate from which the steering axis can still stop
    in time, sqrt(2 a (|e| - e0 / 2)), which continues the proportional part smoothly at e0 = a /
    gain^2; never above the limit. The error is the target minus the heading, radians in (-pi, pi];
    a is the assumed deceleration.
    """
    size, braking_rad_per_s2 = abs(error_rad), config.steering_braking_rad_per_s2
    linear_rad = braking_rad_per_s2 / config.heading_gain_per_s**2
    if size <= linear_rad:
        rate = config.heading_gain_per_s * size
    else:
        rate = math.sqrt(2.0 * braking_rad_per_s2 * (size - linear_rad / 2.0))
    return math.copysign(min(rate, config.steering_limit_rad_per_s), error_rad)


def cruise_fraction(error_rad: float, stop_error_rad: float) -> float:
    """Return the fraction of the cruising speed to drive at, in [0, 1].

    One without an error, zero from `stop_error_rad`, in between the cosine of the error scaled to
    that range.
    """
    stop = math.cos(stop_error_rad)
    return max(0.0, (math.cos(error_rad) - stop) / (1.0 - stop))


@dataclass
class HeadingFollower:
    """Turns on the spot to the first heading, then follows headings while driving.

    Attributes:
        heading_rad: Target heading, radians in `map`, or None before the first.
    """

    heading_rad: float | None = None
    _aligned: bool = False

    def turn_to(self, heading_rad: float) -> None:
        """Set a heading; if it differs from the last one, the robot stops and turns to it."""
        if heading_rad != self.heading_rad:
            self.heading_rad = heading_rad
            self._aligned = False

    def steer_to(self, heading_rad: float) -> None:
        """Set a heading; the robot keeps driving, the slower the larger its error."""
        self.heading_rad = heading_rad

    def command(self, pose: Pose2, config: ControllerConfig) -> Twist2:
        """Return the velocities that follow the heading from a pose."""
        if self.heading_rad is None:
            return STANDING
        error_rad = angle_difference(self.heading_rad, pose.heading_rad)
        if abs(error_rad) <= config.align_tolerance_rad:
            self._aligned = True
        fraction = cruise_fraction(error_rad, config.stop_heading_error_rad)
        return Twist2(
            linear_m_per_s=config.cruise_speed_m_per_s * fraction if self._aligned else 0.0,
            steering_rad_per_s=steering_rate(error_rad, config),
        )
