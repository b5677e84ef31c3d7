"""A camera anywhere on the last link of the head: its offset and its attitude."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np

from goalreach_msgs_py.camera import camera_azimuth, points_in_camera
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2


def attitude(roll_rad: float, pitch_rad: float, yaw_rad: float) -> FloatArray:
    """Return the rotation from camera (x forward, y left, z up) to link, as REP-103 has it."""
    (cr, cp, cy), (sr, sp, sy) = (
        [turn(angle) for angle in (roll_rad, pitch_rad, yaw_rad)] for turn in (math.cos, math.sin)
    )
    yaw = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    pitch = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    roll = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    rotation: FloatArray = yaw @ pitch @ roll
    return rotation


class CameraMount:
    """Expresses a mounted camera by pan, tilt and roll of a camera on the axis.

    The offset is exact where the camera looks along its link or the link has no tilt.

    Args:
        mount: x, y, z of the optical centre in the link at tilt 0, z from the floor, metres; roll,
            pitch, yaw of the camera, radians.

    Attributes:
        offset_m: Optical centre forward and left of the axis, as the camera looks.
        height_m: Its height where the camera looks level.
    """

    def __init__(self, mount: tuple[float, float, float, float, float, float]) -> None:
        x, y, z, roll, pitch, yaw = mount
        forward = math.cos(yaw) * x + math.sin(yaw) * y
        self.offset_m = forward / math.cos(pitch), math.cos(yaw) * y - math.sin(yaw) * x
        self.height_m = z + forward * math.tan(pitch)
        self._attitude = attitude(roll, pitch, yaw) if roll or pitch or yaw else None

    def look(self, joints: HeadAngles) -> tuple[HeadAngles, float]:
        """Return the joints of a head that looks as the camera does, and the camera's roll."""
        if self._attitude is None:
            return joints, 0.0
        ct, st = math.cos(joints.tilt_rad), math.sin(joints.tilt_rad)
        turned = np.array([[ct, 0.0, -st], [0.0, 1.0, 0.0], [st, 0.0, ct]]) @ self._attitude
        (fx, fy, fz), left_z, up_z = turned[:, 0].tolist(), turned[2, 1], turned[2, 2]
        pan, tilt = joints.pan_rad + math.atan2(fy, fx), math.atan2(fz, math.hypot(fx, fy))
        return replace(joints, pan_rad=pan, tilt_rad=tilt), math.atan2(left_z, up_z)

    def points_in_camera(
        self, points_m: FloatArray, pose: Pose2, joints: HeadAngles
    ) -> FloatArray:
        """Return (n, 3) points of `map` in the optical frame, metres: right, down, forward."""
        joints, roll_rad = self.look(joints)
        axis_m = np.array([pose.x_m, pose.y_m, self.height_m])
        azimuth_rad = camera_azimuth(pose.heading_rad, joints)
        level_m = points_in_camera(points_m, axis_m, azimuth_rad, joints.tilt_rad)
        level_m -= (-self.offset_m[1], 0.0, self.offset_m[0])
        return level_m @ attitude(0.0, 0.0, -roll_rad).T
