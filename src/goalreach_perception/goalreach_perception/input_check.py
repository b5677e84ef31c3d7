"""Validity checks of an image and the measurements of its stamp."""

import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.camera import PinholeCamera, camera_azimuth
from goalreach_msgs_py.values import HeadAngles, Odometry, Pose2

_MOVED_M, _TURNED_RAD = 0.005, 0.005
"""Motion after which two images differ: one pixel at a metre. Chosen."""


def _image_fault(image: object, camera: PinholeCamera) -> str:
    """Return why an image is invalid, or an empty text."""
    if not isinstance(image, np.ndarray):
        return f'image: not an array but {type(image).__name__}'
    if image.dtype != np.uint8:
        return f'image: {image.dtype}, expected uint8 (mono8)'
    expected = (camera.height_px, camera.width_px)
    if image.shape != expected:
        return f'image: shape {image.shape}, expected {expected}'
    return ''


def _motion_fault(joints: HeadAngles, odometry: Odometry) -> str:
    """Return why joint angles or odometry are invalid, or an empty text."""
    for source, values in (('joints', joints), ('odometry', odometry.pose)):
        for name, value in vars(values).items():
            if not math.isfinite(value):
                return f'{source}: {name} is {value}'
    return ''


def input_fault(
    image: object,
    camera: PinholeCamera,
    joints: HeadAngles,
    odometry: Odometry,
    *,
    time_ns: int,
    last_ns: int | None,
) -> str:
    """Return why an image or its measurements are invalid, or an empty text.

    Args:
        image: Expected to be (height, width) mono8.
        camera: Intrinsics of the camera.
        joints: Encoder readings.
        odometry: Encoder odometry.
        time_ns: Their common stamp.
        last_ns: Stamp of the last image used, or None before the first.
    """
    if last_ns is not None and time_ns < last_ns:
        return f'time: {time_ns} ns is before the last image, {last_ns} ns'
    return _image_fault(image, camera) or _motion_fault(joints, odometry)


class FrozenImageDetector:
    """Detects a camera that repeats one image while the robot moves."""

    def __init__(self) -> None:
        self._image: NDArray[np.uint8] | None = None
        self._joints: HeadAngles | None = None
        self._pose: Pose2 | None = None

    def fault(self, image: NDArray[np.uint8], joints: HeadAngles, pose: Pose2) -> str:
        """Return why an image is not current, or an empty text.

        Args:
            image: The image.
            joints: Encoder readings.
            pose: Odometry.
        """
        if self._image is None or not _equal(image, self._image):
            self._image, self._joints, self._pose = image, joints, pose
            return ''
        before, at = self._joints, self._pose
        if before is None or at is None or image.min() == image.max():
            return ''  # without noise all dark images are equal
        moved_m = math.hypot(pose.x_m - at.x_m, pose.y_m - at.y_m)
        azimuth = camera_azimuth(pose.heading_rad, joints)
        turned = math.remainder(azimuth - camera_azimuth(at.heading_rad, before), math.tau)
        turned_rad = max(abs(turned), abs(joints.tilt_rad - before.tilt_rad))
        if moved_m < _MOVED_M and turned_rad < _TURNED_RAD:
            return ''
        return 'image: the same as before, though the robot has moved'


def _equal(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> bool:
    """Return whether two images are equal; the noise of one row usually decides."""
    middle = len(one) // 2
    return one[middle].tobytes() == other[middle].tobytes() and np.array_equal(one, other)


def odometry_jump(
    before: Pose2, now: Pose2, dt_s: float, *, speed_m_per_s: float, turn_rad_per_s: float
) -> bool:
    """Return whether odometry moved faster than the robot can.

    Args:
        before: Odometry pose at the last image.
        now: Odometry pose now.
        dt_s: Time between them.
        speed_m_per_s: Maximum speed of the robot.
        turn_rad_per_s: Maximum steering rate.
    """
    moved_m = math.hypot(now.x_m - before.x_m, now.y_m - before.y_m)
    turned_rad = angle_difference(now.heading_rad, before.heading_rad)
    too_far = moved_m > 1.5 * speed_m_per_s * dt_s + 0.02
    return too_far or abs(turned_rad) > 1.5 * turn_rad_per_s * dt_s + 0.05
