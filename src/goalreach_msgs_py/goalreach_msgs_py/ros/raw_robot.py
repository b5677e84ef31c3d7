"""What the robot and its drivers send, as bytes: pairs of `ros_sensor_messages`, quicker.

`x_to_raw` gives the bytes of `x_to_msg`; `x_from_raw` gives, or refuses, what `x_from_msg` does.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
import math

from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry as OdometryMsg
from sensor_msgs.msg import JointState, LaserScan

from goalreach_msgs_py.cdr import CdrLayout, Fixed, Run, without_stamp
from goalreach_msgs_py.ros.common_messages import (
    pose_from_numbers,
    pose_to_numbers,
    require_finite,
    twist_from_msg,
    twist_from_numbers,
    twist_to_numbers,
)
from goalreach_msgs_py.ros.sensor_messages import (
    bumpers_from_msg,
    bumpers_to_msg,
    head_from_msg,
    odometry_from_msg,
)
from goalreach_msgs_py.ros.subscribe_raw import read_message
from goalreach_msgs_py.topics import BASE_FRAME, BUMPER_FRAME, HEAD_JOINTS, ODOM_FRAME
from goalreach_msgs_py.values import HeadAngles, Odometry, Twist2

_BUMPERS = 20
_KEPT = 8


def clock_to_raw(stamp_ns: int) -> bytes:
    """Return the time as rosgraph_msgs/Clock."""
    return _clock().pack(stamp_ns)


@lru_cache(maxsize=1)
def _clock() -> CdrLayout:
    return CdrLayout()


def odometry_to_raw(odometry: Odometry, stamp_ns: int, *, frame_id: str) -> bytes:
    """Return a pose and velocity as nav_msgs/Odometry, child frame `base_link`.

    Args:
        odometry: Pose in `frame_id`, velocity in `base_link`.
        stamp_ns: Stamp, nanoseconds.
        frame_id: `odom` for the encoders, `map` for the truth.
    """
    pose, twist = pose_to_numbers(odometry.pose), twist_to_numbers(odometry.twist)
    return _odometry_layout(frame_id).pack(stamp_ns, pose, twist)


@lru_cache(maxsize=_KEPT)
def _odometry_layout(frame_id: str) -> CdrLayout:
    unknown = Fixed('36d', *bytes(36))
    return CdrLayout(frame_id, BASE_FRAME, Run('7d'), unknown, Run('6d'), unknown)


def odometry_from_raw(raw: bytes, *, frame_id: str = ODOM_FRAME) -> Odometry:
    """Return pose and velocity of a nav_msgs/Odometry.

    Args:
        raw: The message.
        frame_id: The frame that is expected, as in `odometry_to_raw`; others take longer to read.

    Raises:
        MessageError: A number is not finite.
    """
    layout = _odometry_layout(frame_id)
    if not layout.fits(raw):
        return odometry_from_msg(read_message(raw, OdometryMsg))
    twist = twist_from_numbers(layout.unpack(raw, 1))
    return Odometry(pose=pose_from_numbers(layout.unpack(raw)), twist=twist)


def head_to_raw(head: HeadAngles, stamp_ns: int) -> bytes:
    """Return the three joint angles as sensor_msgs/JointState."""
    return _head_layout().pack(stamp_ns, (head.turret_rad, head.pan_rad, head.tilt_rad))


@lru_cache(maxsize=1)
def _head_layout() -> CdrLayout:
    joints = len(HEAD_JOINTS)
    return CdrLayout(
        BASE_FRAME,
        Fixed('I', joints),
        *HEAD_JOINTS,
        Fixed('I', joints),
        Run(f'{joints}d'),
        Fixed('2I', 0, 0),
    )


def head_from_raw(raw: bytes) -> HeadAngles:
    """Return the head's joint angles of a sensor_msgs/JointState, found by name.

    Raises:
        MessageError: A joint is missing or its position is not finite.
    """
    layout = _head_layout()
    if not layout.fits(raw):
        return head_from_msg(read_message(raw, JointState))
    angles = zip(HEAD_JOINTS, layout.unpack(raw), strict=True)
    turret, pan, tilt = (require_finite(name, angle) for name, angle in angles)
    return HeadAngles(turret_rad=turret, pan_rad=pan, tilt_rad=tilt)


def bumpers_to_raw(
    pressed: Sequence[bool], stamp_ns: int, *, body_radius_m: float, scan_time_s: float
) -> bytes:
    """Return 20 bumpers as sensor_msgs/LaserScan; see `bumpers_to_msg`."""
    ranges = [body_radius_m if state else math.inf for state in pressed]
    return _bumper_layout(body_radius_m, scan_time_s).pack(stamp_ns, ranges)


@lru_cache(maxsize=_KEPT)
def _bumper_layout(body_radius_m: float, scan_time_s: float) -> CdrLayout:
    message = bumpers_to_msg(
        [False] * _BUMPERS, 0, body_radius_m=body_radius_m, scan_time_s=scan_time_s
    )
    return CdrLayout(
        BUMPER_FRAME,
        Fixed('3f', message.angle_min, message.angle_max, message.angle_increment),
        Fixed('2f', message.time_increment, message.scan_time),
        Fixed('2f', message.range_min, message.range_max),
        Fixed('I', _BUMPERS),
        Run(f'{_BUMPERS}f'),
        Fixed('I', 0),
    )


def bumpers_from_raw(raw: bytes) -> tuple[bool, ...]:
    """Return which of the bumpers of a sensor_msgs/LaserScan are pressed.

    Raises:
        MessageError: There are not 20 rays, or a ray is NaN.
    """
    return _bumpers(without_stamp(raw))


@lru_cache(maxsize=_KEPT)
def _bumpers(raw: bytes) -> tuple[bool, ...]:
    """Return what is pressed; it is nearly always the same, but for the stamp."""
    return bumpers_from_msg(read_message(raw, LaserScan))


def twist_to_raw(twist: Twist2, stamp_ns: int) -> bytes:
    """Return a drive command as geometry_msgs/TwistStamped in `base_link`."""
    return _twist_layout().pack(stamp_ns, twist_to_numbers(twist))


@lru_cache(maxsize=1)
def _twist_layout() -> CdrLayout:
    return CdrLayout(BASE_FRAME, Run('6d'))


def twist_from_raw(raw: bytes) -> Twist2:
    """Return the drive command of a geometry_msgs/TwistStamped.

    Raises:
        MessageError: A velocity is not finite.
    """
    layout = _twist_layout()
    if not layout.fits(raw):
        return twist_from_msg(read_message(raw, TwistStamped))
    return twist_from_numbers(layout.unpack(raw))
