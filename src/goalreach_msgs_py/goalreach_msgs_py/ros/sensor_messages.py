"""What the robot's sensors and head send: values to messages and back."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
import math

from nav_msgs.msg import Odometry as OdometryMsg
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.ros.common_messages import (
    MessageError,
    header,
    pose_from_msg,
    pose_to_msg,
    require_finite,
)
from goalreach_msgs_py.topics import BASE_FRAME, BUMPER_FRAME, CAMERA_FRAME, HEAD_JOINTS
from goalreach_msgs_py.values import FloatArray, HeadAngles, Odometry, Twist2

IMAGE_ENCODING = 'mono8'
_BUMPERS = 20
_DISTORTION_TERMS = 5


def image_to_msg(image: NDArray[np.uint8], stamp_ns: int) -> Image:
    """Return a (height, width) grey image as sensor_msgs/Image mono8."""
    height, width = image.shape
    data = array('B')
    data.frombytes(image.data if image.flags.c_contiguous else image.tobytes())
    return Image(
        header=header(stamp_ns, CAMERA_FRAME),
        height=height,
        width=width,
        encoding=IMAGE_ENCODING,
        step=width,
        data=data,
    )


def image_from_msg(message: Image) -> NDArray[np.uint8]:
    """Return a sensor_msgs/Image mono8 as a (height, width) array that shares its memory.

    Raises:
        MessageError: Another encoding, or sizes that do not fit the data.
    """
    if message.encoding != IMAGE_ENCODING:
        raise MessageError(f'encoding = {message.encoding!r}: must be {IMAGE_ENCODING}')
    height, width, step = message.height, message.width, message.step
    if step < width or height * step != len(message.data) or 0 in (height, width):
        size = f'{width} x {height}, step {step}, {len(message.data)} bytes'
        raise MessageError(f'image of {size}: sizes do not fit one another')
    pixels = np.frombuffer(message.data, dtype=np.uint8).reshape(height, step)
    return pixels[:, :width]


def camera_to_msg(camera: PinholeCamera, stamp_ns: int) -> CameraInfo:
    """Return the intrinsics as sensor_msgs/CameraInfo, model plumb_bob."""
    fx, fy, cx, cy = camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
    return CameraInfo(
        header=header(stamp_ns, CAMERA_FRAME),
        height=camera.height_px,
        width=camera.width_px,
        distortion_model='plumb_bob',
        d=list(camera.distortion),
        k=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def camera_from_msg(message: CameraInfo) -> PinholeCamera:
    """Return the intrinsics of a sensor_msgs/CameraInfo.

    Raises:
        MessageError: Intrinsics that no camera has, or a distortion model other than plumb_bob.
    """
    distortion = [require_finite('d', term) for term in message.d]
    if len(distortion) not in (0, _DISTORTION_TERMS):
        raise MessageError(f'd = {distortion}: must be 5 numbers or none')
    k1, k2, p1, p2, k3 = distortion or [0.0] * _DISTORTION_TERMS
    try:
        return PinholeCamera(
            width_px=message.width,
            height_px=message.height,
            fx_px=float(message.k[0]),
            fy_px=float(message.k[4]),
            cx_px=float(message.k[2]),
            cy_px=float(message.k[5]),
            distortion=(k1, k2, p1, p2, k3),
        )
    except ConfigurationError as error:
        raise MessageError(str(error)) from None


def odometry_to_msg(
    odometry: Odometry, stamp_ns: int, *, frame_id: str, covariance: FloatArray | None = None
) -> OdometryMsg:
    """Return a pose and velocity as nav_msgs/Odometry, child frame `base_link`.

    Args:
        odometry: Pose in `frame_id`, velocity in `base_link`.
        stamp_ns: Stamp, nanoseconds.
        frame_id: `odom` for the encoders, `map` for the truth.
        covariance: (36,) of the pose, or None for zeros.
    """
    message = OdometryMsg(header=header(stamp_ns, frame_id), child_frame_id=BASE_FRAME)
    message.pose.pose = pose_to_msg(odometry.pose)
    if covariance is not None:
        message.pose.covariance = covariance
    message.twist.twist.linear.x = float(odometry.twist.linear_m_per_s)
    message.twist.twist.angular.z = float(odometry.twist.steering_rad_per_s)
    return message


def odometry_from_msg(message: OdometryMsg) -> Odometry:
    """Return pose and velocity of a nav_msgs/Odometry.

    Raises:
        MessageError: A number is not finite.
    """
    twist = message.twist.twist
    return Odometry(
        pose=pose_from_msg(message.pose.pose),
        twist=Twist2(
            linear_m_per_s=require_finite('twist.linear.x', twist.linear.x),
            steering_rad_per_s=require_finite('twist.angular.z', twist.angular.z),
        ),
    )


def head_to_msg(head: HeadAngles, stamp_ns: int) -> JointState:
    """Return the three joint angles as sensor_msgs/JointState."""
    return JointState(
        header=header(stamp_ns, BASE_FRAME),
        name=list(HEAD_JOINTS),
        position=[float(head.turret_rad), float(head.pan_rad), float(head.tilt_rad)],
    )


def head_from_msg(message: JointState) -> HeadAngles:
    """Return the head's joint angles, found by name.

    Raises:
        MessageError: A joint is missing or its position is not finite.
    """
    positions = dict(zip(message.name, message.position, strict=False))
    missing = [name for name in HEAD_JOINTS if name not in positions]
    if missing:
        raise MessageError(f'name = {list(message.name)}: {missing[0]} is missing')
    turret, pan, tilt = (require_finite(name, positions[name]) for name in HEAD_JOINTS)
    return HeadAngles(turret_rad=turret, pan_rad=pan, tilt_rad=tilt)


def bumpers_to_msg(
    pressed: Sequence[bool], stamp_ns: int, *, body_radius_m: float, scan_time_s: float
) -> LaserScan:
    """Return 20 bumpers as sensor_msgs/LaserScan: the body radius where pressed, +inf where not.

    Args:
        pressed: (20,) by sensor; sensor i points to 18 i degrees in `bumper_link`.
        stamp_ns: Stamp, nanoseconds.
        body_radius_m: Radius of the bumper ring.
        scan_time_s: Time between readings.
    """
    step_rad = 2.0 * math.pi / _BUMPERS
    return LaserScan(
        header=header(stamp_ns, BUMPER_FRAME),
        angle_min=0.0,
        angle_max=step_rad * (_BUMPERS - 1),
        angle_increment=step_rad,
        scan_time=scan_time_s,
        range_min=0.0,
        range_max=2.0 * body_radius_m,
        ranges=[body_radius_m if state else math.inf for state in pressed],
    )


def bumpers_from_msg(message: LaserScan) -> tuple[bool, ...]:
    """Return which of the bumpers are pressed.

    Raises:
        MessageError: There are not 20 rays, or a ray is NaN.
    """
    if len(message.ranges) != _BUMPERS:
        raise MessageError(f'ranges has {len(message.ranges)} rays: must be {_BUMPERS}')
    if any(math.isnan(distance) for distance in message.ranges):
        raise MessageError('ranges holds NaN: must be a distance or +inf')
    return tuple(math.isfinite(distance) for distance in message.ranges)
