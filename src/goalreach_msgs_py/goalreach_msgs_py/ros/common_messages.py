"""Stamps, quaternions and planar poses as messages and back."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, Quaternion, TwistStamped
from std_msgs.msg import Header

from goalreach_msgs_py.errors import GoalreachError, one_line
from goalreach_msgs_py.topics import BASE_FRAME
from goalreach_msgs_py.values import Pose2, Twist2

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
    x, y, z, qx, qy, qz, qw = pose_to_numbers(pose)
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def pose_to_numbers(pose: Pose2) -> tuple[float, ...]:
    """Return the numbers of a geometry_msgs/Pose: x, y, z and the quaternion x, y, z, w."""
    half_rad = pose.heading_rad / 2.0
    turn = (0.0, 0.0, math.sin(half_rad), math.cos(half_rad))
    return (float(pose.x_m), float(pose.y_m), 0.0, *turn)


def pose_from_msg(message: Pose) -> Pose2:
    """Return the planar part of a geometry_msgs/Pose; heading in (-pi, pi].

    Raises:
        MessageError: A number is not finite or the orientation is no rotation.
    """
    p, q = message.position, message.orientation
    return pose_from_numbers((p.x, p.y, p.z, q.x, q.y, q.z, q.w))


def pose_from_numbers(numbers: Sequence[float]) -> Pose2:
    """Return the planar part of a pose given as x, y, z and the quaternion x, y, z, w.

    Raises:
        MessageError: A number is not finite or the orientation is no rotation.
    """
    x_m, y_m, _, *turn = numbers
    if not all(map(math.isfinite, (x_m, y_m, *turn))):
        raise MessageError(f'pose = {(x_m, y_m, *turn)}: must be finite')
    if not any(turn):
        raise MessageError('orientation = (0, 0, 0, 0): must be a rotation')
    scale = max(map(abs, turn))  # so that no square overflows
    x, y, z, w = (part / scale for part in turn)
    sine = 2.0 * (w * z + x * y)
    cosine = w * w + x * x - y * y - z * z
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=math.atan2(sine, cosine))


def twist_to_msg(twist: Twist2, stamp_ns: int) -> TwistStamped:
    """Return a drive command as geometry_msgs/TwistStamped in `base_link`."""
    message = TwistStamped(header=header(stamp_ns, BASE_FRAME))
    message.twist.linear.x, *_, message.twist.angular.z = twist_to_numbers(twist)
    return message


def twist_to_numbers(twist: Twist2) -> tuple[float, ...]:
    """Return the numbers of a geometry_msgs/Twist: linear x, y, z and angular x, y, z."""
    return (float(twist.linear_m_per_s), 0.0, 0.0, 0.0, 0.0, float(twist.steering_rad_per_s))


def twist_from_msg(message: TwistStamped) -> Twist2:
    """Return the drive command of a geometry_msgs/TwistStamped.

    Raises:
        MessageError: A velocity is not finite.
    """
    linear, angular = message.twist.linear, message.twist.angular
    return twist_from_numbers((linear.x, linear.y, linear.z, angular.x, angular.y, angular.z))


def twist_from_numbers(numbers: Sequence[float]) -> Twist2:
    """Return the velocities of a twist given as linear x, y, z and angular x, y, z.

    Raises:
        MessageError: A velocity is not finite.
    """
    return Twist2(
        linear_m_per_s=require_finite('twist.linear.x', numbers[0]),
        steering_rad_per_s=require_finite('twist.angular.z', numbers[5]),
    )


def require_finite(field: str, value: Any) -> float:
    """Return the value as a float.

    Raises:
        MessageError: It is not finite.
    """
    number = float(value)
    if not math.isfinite(number):
        raise MessageError(f'{field} = {number}: must be finite')
    return number
