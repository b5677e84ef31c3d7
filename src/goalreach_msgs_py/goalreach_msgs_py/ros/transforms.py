"""The frames of the robot as transforms, published wherever tf2_msgs can be imported.

tf2_msgs is not among the pip wheels, so nothing here depends on it; on a full ROS 2 installation
RViz and Foxglove show the robot by these transforms.
"""

import importlib
import math
from typing import Any

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rclpy.node import Node
from rclpy.qos import QoSProfile

from goalreach_msgs_py.alignment import moved_on
from goalreach_msgs_py.ros.messaging import LATCHED_QOS, frame_prefix, header
from goalreach_msgs_py.topics import BASE_FRAME, BUMPER_FRAME, CAMERA_FRAME, MAP_FRAME, ODOM_FRAME
from goalreach_msgs_py.values import HeadAngles, Pose2

TURRET_FRAME = 'turret_link'
PAN_FRAME = 'pan_link'
TILT_FRAME = 'tilt_link'

_OPTICAL_ROTATION = Quaternion(x=-0.5, y=0.5, z=-0.5, w=0.5)
"""From x forward, z up to x right, y down, z forward (REP-103)."""


def _stamped(
    stamp_ns: int, parent: str, child: str, rotation: Quaternion, **offset_m: float
) -> TransformStamped:
    transform = Transform(translation=Vector3(**offset_m), rotation=rotation)
    return TransformStamped(
        header=header(stamp_ns, parent), child_frame_id=child, transform=transform
    )


def _yaw(angle_rad: float) -> Quaternion:
    return Quaternion(z=math.sin(angle_rad / 2.0), w=math.cos(angle_rad / 2.0))


def odometry_transforms(stamp_ns: int, pose: Pose2, base_yaw_rad: float) -> list[TransformStamped]:
    """Return odom -> base_link and base_link -> bumper_link, by the pose of the encoders.

    `base_yaw_rad` is that of the base in `odom`, which does not turn with the steering.
    """
    to_base, to_bumpers = _yaw(pose.heading_rad), _yaw(base_yaw_rad - pose.heading_rad)
    x, y = float(pose.x_m), float(pose.y_m)
    return [
        _stamped(stamp_ns, ODOM_FRAME, BASE_FRAME, to_base, x=x, y=y),
        _stamped(stamp_ns, BASE_FRAME, BUMPER_FRAME, to_bumpers),
    ]


def head_transforms(
    stamp_ns: int, joints: HeadAngles, camera_height_m: float
) -> list[TransformStamped]:
    """Return base_link -> turret_link -> pan_link -> tilt_link; the lens is on the axis."""
    half_rad = -joints.tilt_rad / 2.0  # upward is a turn about -y
    tilt = Quaternion(y=math.sin(half_rad), w=math.cos(half_rad))
    z = float(camera_height_m)
    return [
        _stamped(stamp_ns, BASE_FRAME, TURRET_FRAME, _yaw(joints.turret_rad)),
        _stamped(stamp_ns, TURRET_FRAME, PAN_FRAME, _yaw(joints.pan_rad), z=z),
        _stamped(stamp_ns, PAN_FRAME, TILT_FRAME, tilt),
    ]


def optical_transform() -> TransformStamped:
    """Return tilt_link -> camera_optical_frame, which never changes."""
    return _stamped(0, TILT_FRAME, CAMERA_FRAME, _OPTICAL_ROTATION)


def map_to_odom(stamp_ns: int, in_map: Pose2, in_odom: Pose2) -> TransformStamped:
    """Return map -> odom, by the estimated pose and the encoders' pose of the same stamp."""
    origin = moved_on(in_map, in_odom, Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0))
    turn = _yaw(origin.heading_rad)
    return _stamped(stamp_ns, MAP_FRAME, ODOM_FRAME, turn, x=origin.x_m, y=origin.y_m)


class TransformPublisher:
    """Publishes on /tf, and on /tf_static what never changes, where tf2_msgs is installed."""

    def __init__(self, node: Node, static: list[TransformStamped] | None = None) -> None:
        self._message: Any = None
        try:
            self._message = importlib.import_module('tf2_msgs.msg').TFMessage
        except ImportError:
            return
        self._prefix = frame_prefix(node)
        self._publisher = node.create_publisher(self._message, '/tf', QoSProfile(depth=100))
        if static:
            self._static = node.create_publisher(self._message, '/tf_static', LATCHED_QOS)
            self._static.publish(self._prefixed(static))

    @property
    def active(self) -> bool:
        """Whether tf2_msgs was found; where it was not, transforms need not be computed."""
        return self._message is not None

    def publish(self, transforms: list[TransformStamped]) -> None:
        """Publish transforms; to be called only where it is active."""
        self._publisher.publish(self._prefixed(transforms))

    def _prefixed(self, transforms: list[TransformStamped]) -> object:
        for each in transforms:
            each.header.frame_id = self._prefix + each.header.frame_id
            each.child_frame_id = self._prefix + each.child_frame_id
        return self._message(transforms=transforms)
