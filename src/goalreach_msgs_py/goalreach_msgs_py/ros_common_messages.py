"""Stamps, quaternions and planar poses as messages and back."""

from __future__ import annotations

import math
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Pose, Quaternion, TwistStamped
from std_msgs.msg import Header

from goalreach_msgs_py.errors import GoalreachError, one_line
from goalreach_msgs_py.topics import BASE_FRAME
from goalreach_msgs_py.values import Pose2, Twist2

__all__ = [
    'MessageError',
    'header',
    'pose_from_msg',
    'pose_to_msg',
    'require_finite',
    'stamp_from_msg',
    'stamp_to_msg',
    'twist_from_msg',
    'twist_to_msg',
]

_NS_PER_S = 1_000_000_000


class MessageError(GoalreachError):
    """A message whose content cannot be used; the text names topic-level field and value."""

    def __init__(self, text: str) -> None:
        """Keep the text to one line: what came over the wire may be long."""
        super().__init__(one_line(text))


def stamp_to_msg(stamp_ns: int) -> Time:
    """Return nanoseconds as builtin_interfaces/Time."""
    return Time(sec=stamp_ns // _NS_PER_S, nanosec=stamp_ns % _NS_PER_S)


def stamp_from_msg(stamp: Time) -> int:
    """Return builtin_interfaces/Time as nanoseconds."""
    return int(stamp.sec) * _NS_PER_S + int(stamp.nanosec)


def header(stamp_ns: int, frame_id: str) -> Header:
    """Return a header with that stamp and frame."""
    return Header(stamp=stamp_to_msg(stamp_ns), frame_id=frame_id)


def pose_to_msg(pose: Pose2) -> Pose:
    """Return a planar pose as geometry_msgs/Pose with z = 0."""
    message = Pose()
    message.position.x = float(pose.x_m)
    message.position.y = float(pose.y_m)
    half_rad = pose.heading_rad / 2.0
    message.orientation = Quaternion(z=math.sin(half_rad), w=math.cos(half_rad))
    return message


def pose_from_msg(message: Pose) -> Pose2:
    """Return the planar part of a geometry_msgs/Pose; heading in (-pi, pi].

    Raises:
        MessageError: A number is not finite or the orientation is no rotation.
    """
    q = message.orientation
    parts = (message.position.x, message.position.y, q.x, q.y, q.z, q.w)
    if not all(math.isfinite(part) for part in parts):
        raise MessageError(f'pose = {parts}: must be finite')
    if q.x == q.y == q.z == q.w == 0.0:
        raise MessageError('orientation = (0, 0, 0, 0): must be a rotation')
    scale = max(abs(part) for part in parts[2:])  # so that no square overflows
    x, y, z, w = (part / scale for part in parts[2:])
    sine = 2.0 * (w * z + x * y)
    cosine = w * w + x * x - y * y - z * z
    return Pose2(
        x_m=message.position.x, y_m=message.position.y, heading_rad=math.atan2(sine, cosine)
    )


def twist_to_msg(twist: Twist2, stamp_ns: int) -> TwistStamped:
    """Return a drive command as geometry_msgs/TwistStamped in `base_link`."""
    message = TwistStamped(header=header(stamp_ns, BASE_FRAME))
    message.twist.linear.x = float(twist.linear_m_per_s)
    message.twist.angular.z = float(twist.steering_rad_per_s)
    return message


def twist_from_msg(message: TwistStamped) -> Twist2:
    """Return the drive command of a geometry_msgs/TwistStamped.

    Raises:
        MessageError: A velocity is not finite.
    """
    twist = message.twist
    require_finite('twist.linear.x', twist.linear.x)
    require_finite('twist.angular.z', twist.angular.z)
    return Twist2(linear_m_per_s=twist.linear.x, steering_rad_per_s=twist.angular.z)


def require_finite(field: str, value: Any) -> float:
    """Return the value as a float.

    Raises:
        MessageError: It is not finite.
    """
    number = float(value)
    if not math.isfinite(number):
        raise MessageError(f'{field} = {number}: must be finite')
    return number
