"""Validity checks of an image and the measurements of its stamp."""

import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.camera import PinholeCamera, camera_azimuth
from goalreach_msgs_py.values import HeadAngles, Odometry, Pose2

_MOVED_M, _TURNED_RAD = 0.005, 0.005
"""Motion after which two images differ: one pixel at a metre. Chosen."""


def input_fault(
    image: object,
    camera: PinholeCamera,
    joints: HeadAngles,
    odometry: Odometry,
    *,
    time_ns: int,
    last_ns: int | None,
) -> str:
    """Return why an image or its measurements are invalid, or an empty text."""
    if last_ns is not None and time_ns < last_ns:
        return f'time: {time_ns} ns is before the last image, {last_ns} ns'
    if not isinstance(image, np.ndarray):
        return f'image: not an array but {type(image).__name__}'
    if image.dtype != np.uint8:
        return f'image: {image.dtype}, expected uint8 (mono8)'
    if image.shape != (expected := (camera.height_px, camera.width_px)):
        return f'image: shape {image.shape}, expected {expected}'
    pose, head_rad = odometry.pose, joints.turret_rad + joints.pan_rad + joints.tilt_rad
    if not math.isfinite(pose.x_m + pose.y_m + pose.heading_rad + head_rad):
        for source, values in (('joints', joints), ('odometry', pose)):
            for name, value in vars(values).items():
                if not math.isfinite(value):
                    return f'{source}: {name} is {value}'
    return ''


class FrozenImageDetector:
    """Detects a camera that repeats one image while the robot moves."""

    def __init__(self) -> None:
        self._last: tuple[NDArray[np.uint8], HeadAngles, Pose2] | None = None

    def fault(self, image: NDArray[np.uint8], joints: HeadAngles, pose: Pose2) -> str:
        """Return why an image is not current, or an empty text."""
        if self._last is None or not _equal(image, self._last[0]):
            self._last = image, joints, pose
            return ''
        _, before, at = self._last
        if image.min() == image.max():
            return ''  # without noise all dark images are equal
        moved_m = math.hypot(pose.x_m - at.x_m, pose.y_m - at.y_m)
        azimuth = camera_azimuth(pose.heading_rad, joints)
        turned = math.remainder(azimuth - camera_azimuth(at.heading_rad, before), math.tau)
        turned_rad = max(abs(turned), abs(joints.tilt_rad - before.tilt_rad))
        moved = moved_m >= _MOVED_M or turned_rad >= _TURNED_RAD
        return 'image: the same as before, though the robot has moved' if moved else ''


def _equal(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> bool:
    """Return whether two images are equal; the noise of one row usually decides."""
    middle = len(one) // 2
    same = one.shape == other.shape and one[middle].tobytes() == other[middle].tobytes()
    return same and np.array_equal(one, other)


def odometry_jump(
    before: Pose2, now: Pose2, dt_s: float, *, speed_m_per_s: float, turn_rad_per_s: float
) -> bool:
    """Return whether odometry moved faster than the robot can."""
    moved_m = math.hypot(now.x_m - before.x_m, now.y_m - before.y_m)
    turned_rad = angle_difference(now.heading_rad, before.heading_rad)
    too_far = moved_m > 1.5 * speed_m_per_s * dt_s + 0.02
    return too_far or abs(turned_rad) > 1.5 * turn_rad_per_s * dt_s + 0.05
