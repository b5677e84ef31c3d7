"""Dead reckoning from the wheel encoders: exact integration of what they count."""

from __future__ import annotations

from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.values import Pose2
from goalreach_sim.path_integral import Motion, displacement

__all__ = ['WheelOdometry']


class WheelOdometry:
    """The second of the two robots that the original simulator keeps: the one encoders believe.

    The encoders count wheel turns, so distance has a scale error and is blind to slip; heading
    is the steering angle since the start and is blind to the base turning under the robot.

    Args:
        scale: Distance by the encoders over distance driven.
    """

    def __init__(self, scale: float) -> None:
        self.scale = scale
        self._x_m = self._y_m = self._yaw_rad = 0.0

    def define(self, pose: Pose2, steering_rad: float) -> None:
        """Count on from a pose that holds at the present steering angle."""
        self._x_m, self._y_m = pose.x_m, pose.y_m
        self._yaw_rad = pose.heading_rad - steering_rad

    def count(self, motion: Motion, dt_s: float) -> None:
        """Count a piece of the motion of the wheels, its heading being the steering angle."""
        steering_rad, turn, turn_change, speed, acceleration = motion
        scale = self.scale
        dx_m, dy_m = displacement(
            Motion(
                self._yaw_rad + steering_rad,
                turn,
                turn_change,
                scale * speed,
                scale * acceleration,
            ),
            dt_s,
        )
        self._x_m += dx_m
        self._y_m += dy_m

    def pose(self, steering_rad: float) -> Pose2:
        """Return the pose in `odom` at the present steering angle."""
        heading_rad = wrap_angle(self._yaw_rad + steering_rad)
        return Pose2(x_m=self._x_m, y_m=self._y_m, heading_rad=heading_rad)
