"""Sensor readings, wheel odometry, bumpers and the errors drawn for a run."""

from collections.abc import Iterable
from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import FloatArray, HeadAngles, Odometry, Pose2
from goalreach_sim.path_integral import Motion, displacement


@dataclass(frozen=True, kw_only=True, eq=False)
class SensorFrame:
    """All sensor readings of one instant, with the ground truth.

    Attributes:
        time_ns: The robot's clock.
        image: (height, width) grey values, a new array.
        camera: The calibrated camera; the true lens differs by the drawn focal error.
        joints: Turret, pan and tilt as their encoders read them.
        odometry: Pose and velocity measured by the wheel encoders, in `odom`.
        bumpers: 20 flags; sensor i sits at 18 i degrees on the base.
        truth: True pose and velocity in `map`; for evaluation and display only.
        truth_head: True angles of turret, pan and tilt.
        base_yaw_rad: Orientation of the base, which carries the bumpers, by the encoders, in
            `odom`.
        sonar: 16 ranges from the robot's axis, metres, infinite without an echo; sensor i looks
            to 22.5 i degrees on the base. Empty where the robot has no sonar.
    """

    time_ns: int
    image: NDArray[np.uint8]
    camera: PinholeCamera
    joints: HeadAngles
    odometry: Odometry
    bumpers: tuple[bool, ...]
    truth: Odometry
    truth_head: HeadAngles
    base_yaw_rad: float
    sonar: tuple[float, ...] = ()


@dataclass
class WheelOdometry:
    """Dead reckoning by wheel encoders, independent of the true pose.

    The encoders count wheel turns: the distance has a scale error, measured over driven, and
    misses slip; the heading is the steering angle since the start and misses rotations of the
    base.
    """

    scale: float
    _x_m: float = 0.0
    _y_m: float = 0.0
    _yaw_rad: float = 0.0

    def define(self, pose: Pose2, steering_rad: float) -> None:
        """Set the pose that belongs to the present steering angle."""
        self._x_m, self._y_m = pose.x_m, pose.y_m
        self._yaw_rad = pose.heading_rad - steering_rad

    def count(self, motion: Motion, dt_s: float) -> None:
        """Add a piece of motion relative to the base, its heading being the steering angle."""
        steering_rad, turn, turn_change, speed, acceleration = motion
        heading_rad, scale = self._yaw_rad + steering_rad, self.scale
        motion = Motion(heading_rad, turn, turn_change, scale * speed, scale * acceleration)
        dx_m, dy_m = displacement(motion, dt_s)
        self._x_m += dx_m
        self._y_m += dy_m

    def pose(self, steering_rad: float) -> Pose2:
        """Return the pose in `odom` at the present steering angle."""
        heading_rad = wrap_angle(self._yaw_rad + steering_rad)
        return Pose2(x_m=self._x_m, y_m=self._y_m, heading_rad=heading_rad)


BUMPER_COUNT = 20
_SPACING_RAD = math.radians(18.0)
_REACH_RAD = _SPACING_RAD + 1e-9
"""Half the arc of a sensor; the tolerance includes its ends despite rounding."""


def pressed_bumpers(directions_rad: Iterable[float], base_yaw_rad: float) -> tuple[bool, ...]:
    """Return which of the 20 sensors are pressed: their arcs, ends included, cover a direction.

    Directions are azimuths in `map`, as is the orientation of the base: not the drive heading.
    """
    bearings_rad = [direction_rad - base_yaw_rad for direction_rad in directions_rad]
    if not bearings_rad:  # as nearly always
        return (False,) * BUMPER_COUNT
    return tuple(
        any(abs(angle_difference(b, index * _SPACING_RAD)) <= _REACH_RAD for b in bearings_rad)
        for index in range(BUMPER_COUNT)
    )


class RunErrors(NamedTuple):
    """The systematic errors of one run.

    Attributes:
        landmark_offsets_m: (n, 3), true minus surveyed positions of the LEDs.
        camera_height_m: True height of the camera minus the nominal one.
        focal_scale: True focal length over the calibrated one.
        pan_bias_rad: True pan angle minus its encoder's.
        tilt_bias_rad: True tilt angle minus its encoder's.
        odometry_scale: Distance measured by the encoders over distance driven.
        drift_rad_per_m: Rotation of the base per metre driven, which the encoders miss.
        level_rad: How far the base leans: its rotation about its own axes x and y.
    """

    landmark_offsets_m: FloatArray
    camera_height_m: float
    focal_scale: float
    pan_bias_rad: float
    tilt_bias_rad: float
    odometry_scale: float
    drift_rad_per_m: float
    level_rad: tuple[float, float]


def draw_run_errors(noise: NoiseModel, landmarks: int, rng: np.random.Generator) -> RunErrors:
    """Draw the errors of one run from normal distributions, always the same number of draws."""
    height, focal, pan, tilt, scale, drift = rng.standard_normal(6).tolist()
    about_x, about_y = rng.spawn(1)[0].standard_normal(2).tolist()
    return RunErrors(
        landmark_offsets_m=noise.survey_error_m * rng.standard_normal((landmarks, 3)),
        camera_height_m=noise.camera_height_error_m * height,
        focal_scale=1.0 + noise.focal_error * focal,
        pan_bias_rad=noise.pan_tilt_bias_rad * pan,
        tilt_bias_rad=noise.pan_tilt_bias_rad * tilt,
        odometry_scale=1.0 + noise.odometry_scale_error * scale,
        drift_rad_per_m=noise.odometry_drift_rad_per_m * drift,
        level_rad=(noise.level_error_rad * about_x, noise.level_error_rad * about_y),
    )
