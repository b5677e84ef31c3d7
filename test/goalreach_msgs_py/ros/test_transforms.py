"""The robot's frames, composed by hand-written rotations."""

import math

from geometry_msgs.msg import TransformStamped
import numpy as np
import pytest

from goalreach_msgs_py.camera import camera_azimuth, optical_rotation
from goalreach_msgs_py.ros.transforms import (
    head_transforms,
    map_to_odom,
    odometry_transforms,
    optical_transform,
)
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2

STAMP = 5_000_000_000
HEIGHT_M = 1.1
HEAD = HeadAngles(turret_rad=0.7, pan_rad=-0.2, tilt_rad=0.3)
IN_ODOM = Pose2(x_m=1.0, y_m=2.0, heading_rad=0.4)
IN_MAP = Pose2(x_m=3.0, y_m=1.0, heading_rad=-0.9)


def matrix(transform: TransformStamped) -> FloatArray:
    """Return the 4 x 4 matrix that takes points of the child frame to the parent frame."""
    q, t = transform.transform.rotation, transform.transform.translation
    w, x, y, z = q.w, q.x, q.y, q.z
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), t.x],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), t.y],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), t.z],
        [0, 0, 0, 1],
    ])  # fmt: skip


def chain(*transforms: TransformStamped) -> FloatArray:
    product = np.eye(4)
    parent = None
    for each in transforms:
        assert parent in (None, each.header.frame_id)
        parent = each.child_frame_id
        product = product @ matrix(each)
    return product


def test_level_camera_looks_along_the_heading() -> None:
    level = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
    camera = chain(*head_transforms(STAMP, level, HEIGHT_M), optical_transform())
    ahead_2_m = camera @ np.array([0.0, 0.0, 2.0, 1.0])
    below_1_m = camera @ np.array([0.0, 1.0, 0.0, 1.0])
    right_1_m = camera @ np.array([1.0, 0.0, 0.0, 1.0])
    assert ahead_2_m[:3] == pytest.approx([2.0, 0.0, 1.1])
    assert below_1_m[:3] == pytest.approx([0.0, 0.0, 0.1])
    assert right_1_m[:3] == pytest.approx([0.0, -1.0, 1.1])


def test_tilting_up_raises_the_view() -> None:
    up = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=math.radians(30))
    camera = chain(*head_transforms(STAMP, up, HEIGHT_M), optical_transform())
    ahead_2_m = camera @ np.array([0.0, 0.0, 2.0, 1.0])
    assert ahead_2_m[:3] == pytest.approx([math.sqrt(3.0), 0.0, 2.1])


def test_frames_agree_with_the_camera_model() -> None:
    odom_to_base, _ = odometry_transforms(STAMP, IN_ODOM, base_yaw_rad=0.1)
    map_odom = map_to_odom(STAMP, IN_MAP, IN_ODOM)
    camera = chain(
        map_odom, odom_to_base, *head_transforms(STAMP, HEAD, HEIGHT_M), optical_transform()
    )
    rotation = optical_rotation(camera_azimuth(IN_MAP.heading_rad, HEAD), HEAD.tilt_rad)
    assert camera[:3, :3] == pytest.approx(rotation.T)
    assert camera[:3, 3] == pytest.approx([IN_MAP.x_m, IN_MAP.y_m, HEIGHT_M])


def test_the_base_does_not_turn_with_the_steering() -> None:
    for heading in (0.0, 1.0, -2.0):
        pose = Pose2(x_m=0.0, y_m=0.0, heading_rad=heading)
        bumper = chain(*odometry_transforms(STAMP, pose, base_yaw_rad=0.25))
        assert bumper @ np.array([1.0, 0.0, 0.0, 1.0]) == pytest.approx(
            [math.cos(0.25), math.sin(0.25), 0.0, 1.0]
        )
