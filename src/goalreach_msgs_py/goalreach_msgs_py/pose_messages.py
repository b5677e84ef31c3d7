"""Poses and velocities as serialized messages, and back: odometry, command, estimate, path.

`x_to_raw` returns the bytes that ROS 2 sends for the message type that its docstring names.
`x_from_raw` reads them, from any sender, and refuses unusable values by field and value.
`prefix` is that of the frames of a robot in a namespace, such as `robot1/`.
"""

from collections.abc import Sequence
import math

import numpy as np

from goalreach_msgs_py.cdr import CdrReader, CdrWriter, MessageError
from goalreach_msgs_py.topics import BASE_FRAME, MAP_FRAME
from goalreach_msgs_py.values import Odometry, Pose2, PoseEstimate, Twist2

_POSE = '7d'
"""x, y, z and the quaternion x, y, z, w of a geometry_msgs/Pose."""
_TWIST = '6d'
"""linear x, y, z and angular x, y, z of a geometry_msgs/Twist."""
_COVARIANCE = '36d'
_PLANAR = (0, 1, 5)
"""Rows of x, y and yaw in the 6 x 6 covariance of geometry_msgs (REP-103 order)."""
_PLACES = [6 * i + j for i in _PLANAR for j in _PLANAR]


def odometry_to_raw(
    odometry: Odometry, stamp_ns: int, prefix: str = '', *, frame_id: str
) -> bytes:
    """Return a pose and velocity as nav_msgs/Odometry, child frame `base_link`.

    The pose is in `frame_id`: `odom` for the encoders, `map` for the truth.
    """
    writer = CdrWriter(stamp_ns, prefix + frame_id)
    writer.text(prefix + BASE_FRAME)
    writer.numbers(_POSE, *pose_numbers(odometry.pose))
    writer.zeros(_COVARIANCE)
    writer.numbers(_TWIST, *_twist_numbers(odometry.twist))
    writer.zeros(_COVARIANCE)
    return writer.raw()


def odometry_from_raw(raw: bytes) -> Odometry:
    """Return pose and velocity of a nav_msgs/Odometry.

    Raises:
        MessageError: A number is not finite or the orientation is no rotation.
    """
    reader = CdrReader(raw)
    reader.skip_text()
    pose = _pose(reader.numbers(_POSE))
    reader.skip(_COVARIANCE)
    twist = _twist(reader.numbers(_TWIST))
    reader.skip(_COVARIANCE)
    return Odometry(pose=pose, twist=twist)


def twist_to_raw(twist: Twist2, stamp_ns: int | None, prefix: str = '') -> bytes:
    """Return a drive command as geometry_msgs/TwistStamped, without a stamp as Twist."""
    writer = CdrWriter() if stamp_ns is None else CdrWriter(stamp_ns, prefix + BASE_FRAME)
    writer.numbers(_TWIST, *_twist_numbers(twist))
    return writer.raw()


def twist_from_raw(raw: bytes) -> Twist2:
    """Return the drive command of a geometry_msgs/TwistStamped.

    Raises:
        MessageError: A velocity is not finite.
    """
    return _twist(CdrReader(raw).numbers(_TWIST))


def estimate_to_raw(estimate: PoseEstimate, stamp_ns: int, prefix: str = '') -> bytes:
    """Return an estimate as geometry_msgs/PoseWithCovarianceStamped in `map`."""
    covariance = [0.0] * 36
    for place, value in zip(_PLACES, estimate.covariance.ravel().tolist(), strict=True):
        covariance[place] = value
    writer = CdrWriter(stamp_ns, prefix + MAP_FRAME)
    writer.numbers(_POSE, *pose_numbers(estimate.pose))
    writer.numbers(_COVARIANCE, *covariance)
    return writer.raw()


def estimate_from_raw(raw: bytes) -> PoseEstimate:
    """Return the planar estimate of a geometry_msgs/PoseWithCovarianceStamped.

    Raises:
        MessageError: A number is not finite, or a variance is negative.
    """
    reader = CdrReader(raw)
    pose = _pose(reader.numbers(_POSE))
    numbers = reader.numbers(_COVARIANCE)
    planar = [numbers[place] for place in _PLACES]
    if not all(map(math.isfinite, planar)) or min(planar[::4]) < 0:
        raise MessageError(f'covariance with diagonal {planar[::4]}: must be finite, not negative')
    return PoseEstimate(pose=pose, covariance=np.array(planar).reshape(3, 3))


def path_to_raw(poses: Sequence[tuple[int, Pose2]], stamp_ns: int, prefix: str = '') -> bytes:
    """Return (stamp in ns, pose in `map`) pairs as nav_msgs/Path."""
    writer = CdrWriter(stamp_ns, prefix + MAP_FRAME)
    writer.numbers('I', len(poses))
    for pose_stamp_ns, pose in poses:
        writer.numbers('iI', *divmod(pose_stamp_ns, 1_000_000_000))
        writer.text(prefix + MAP_FRAME)
        writer.numbers(_POSE, *pose_numbers(pose))
    return writer.raw()


def pose_numbers(pose: Pose2) -> tuple[float, ...]:
    """Return the numbers of a geometry_msgs/Pose: x, y, z and the quaternion x, y, z, w."""
    half_rad = pose.heading_rad / 2.0
    return (pose.x_m, pose.y_m, 0.0, 0.0, 0.0, math.sin(half_rad), math.cos(half_rad))


def _pose(numbers: Sequence[float]) -> Pose2:
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


def _twist_numbers(twist: Twist2) -> tuple[float, ...]:
    return (twist.linear_m_per_s, 0.0, 0.0, 0.0, 0.0, twist.steering_rad_per_s)


def _twist(numbers: Sequence[float]) -> Twist2:
    return Twist2(
        linear_m_per_s=require_finite('twist.linear.x', numbers[0]),
        steering_rad_per_s=require_finite('twist.angular.z', numbers[5]),
    )


def require_finite(field: str, number: float) -> float:
    """Return a number of a message.

    Raises:
        MessageError: It is not finite.
    """
    if not math.isfinite(number):
        raise MessageError(f'{field} = {number}: must be finite')
    return number
