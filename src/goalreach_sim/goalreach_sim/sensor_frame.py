"""All that the simulated robot senses at one moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.values import HeadAngles, Odometry

__all__ = ['SensorFrame']


@dataclass(frozen=True, kw_only=True, eq=False)
class SensorFrame:
    """All that is sensed at one moment.

    Attributes:
        time_ns: The robot's clock.
        image: (height, width) grey values, a fresh array.
        camera: The camera as calibrated; the real lens differs by the drawn focal error.
        joints: Turret, pan and tilt as their encoders read them.
        odometry: What the wheel encoders say, in `odom`.
        bumpers: 20 flags; sensor i sits at 18 i degrees on the base.
        truth: True pose and velocity in `map`; for evaluation and display only.
        truth_head: True angles of the camera's carriers.
        truth_base_yaw_rad: True orientation of the base, which carries the bumpers, in `map`.
        base_yaw_rad: The same by the encoders: in `odom`.
    """

    time_ns: int
    image: NDArray[np.uint8]
    camera: PinholeCamera
    joints: HeadAngles
    odometry: Odometry
    bumpers: tuple[bool, ...]
    truth: Odometry
    truth_head: HeadAngles
    truth_base_yaw_rad: float
    base_yaw_rad: float
