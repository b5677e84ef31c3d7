"""What perception sends: pose, landmarks and region state as messages and back."""

from __future__ import annotations

from collections.abc import Sequence
import math

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point32, PolygonStamped, PoseWithCovarianceStamped
import numpy as np

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS, parse_region, region_name
from goalreach_msgs_py.ros.common_messages import (
    MessageError,
    header,
    pose_from_msg,
    pose_to_msg,
    require_finite,
    stamp_to_msg,
)
from goalreach_msgs_py.topics import CAMERA_FRAME, MAP_FRAME
from goalreach_msgs_py.values import (
    Confidence,
    FloatArray,
    LandmarkObservation,
    Pose2,
    PoseEstimate,
    RegionState,
)

STATE_NAME = 'region_state'
STATE_SENDER = 'state_estimator'
PLANAR = (0, 1, 5)
"""Rows of x, y and yaw in the 6 x 6 covariance of geometry_msgs (REP-103 order)."""

LEVELS = {
    Confidence.OK: DiagnosticStatus.OK,
    Confidence.UNCERTAIN: DiagnosticStatus.WARN,
    Confidence.STALE: DiagnosticStatus.STALE,
}
_CONFIDENCES = {level: confidence for confidence, level in LEVELS.items()}


def estimate_to_msg(estimate: PoseEstimate, stamp_ns: int) -> PoseWithCovarianceStamped:
    """Return an estimate as geometry_msgs/PoseWithCovarianceStamped in `map`."""
    message = PoseWithCovarianceStamped(header=header(stamp_ns, MAP_FRAME))
    message.pose.pose = pose_to_msg(estimate.pose)
    covariance = np.zeros((6, 6))
    covariance[np.ix_(PLANAR, PLANAR)] = estimate.covariance
    message.pose.covariance = covariance.ravel()
    return message


def estimate_from_msg(message: PoseWithCovarianceStamped) -> PoseEstimate:
    """Return the planar estimate of a geometry_msgs/PoseWithCovarianceStamped.

    Raises:
        MessageError: A number is not finite, or a variance is negative.
    """
    return PoseEstimate(
        pose=pose_from_msg(message.pose.pose),
        covariance=planar_covariance(message.pose.covariance),
    )


def planar_covariance(numbers: Sequence[float]) -> FloatArray:
    """Return the rows and columns of x, y and yaw of a 6 x 6 covariance given row by row.

    Raises:
        MessageError: A number is not finite, or a variance is negative.
    """
    planar = [float(numbers[6 * i + j]) for i in PLANAR for j in PLANAR]
    if not all(map(math.isfinite, planar)) or min(planar[::4]) < 0:
        raise MessageError(f'covariance with diagonal {planar[::4]}: must be finite, not negative')
    return np.array(planar).reshape(3, 3)


def landmarks_to_msg(
    landmarks: Sequence[LandmarkObservation | None], stamp_ns: int
) -> PolygonStamped:
    """Return the seen LEDs as geometry_msgs/PolygonStamped: point i is (u, v, peak) of LED i."""
    message = PolygonStamped(header=header(stamp_ns, CAMERA_FRAME))
    for seen in landmarks:
        values = (math.nan,) * 3 if seen is None else (seen.u_px, seen.v_px, seen.peak_dn)
        message.polygon.points.append(Point32(x=values[0], y=values[1], z=values[2]))
    return message


def landmarks_from_msg(message: PolygonStamped) -> tuple[LandmarkObservation | None, ...]:
    """Return the LEDs of a landmarks message (single precision); None where NaN."""
    return tuple(
        None
        if math.isnan(point.x) or math.isnan(point.y)
        else LandmarkObservation(u_px=point.x, v_px=point.y, peak_dn=point.z)
        for point in message.polygon.points
    )


def state_to_msg(state: RegionState, stamp_ns: int) -> DiagnosticArray:
    """Return a region state as diagnostic_msgs/DiagnosticArray with one status.

    Values are shortest exact decimals: the memberships `mu_x.<label>` and `mu_y.<label>`, the
    pose behind them `x_m`, `y_m`, `heading_rad`, and `goal_probability`.
    """
    numbers = zip(state_keys(), state_numbers(state), strict=True)
    status = DiagnosticStatus(
        level=LEVELS[state.confidence],
        name=STATE_NAME,
        message=region_name(state.region),
        hardware_id=STATE_SENDER,
        values=[KeyValue(key=key, value=repr(number)) for key, number in numbers],
    )
    message = DiagnosticArray(status=[status])
    message.header.stamp = stamp_to_msg(stamp_ns)
    message.header.frame_id = MAP_FRAME
    return message


def state_from_msg(message: DiagnosticArray) -> RegionState:
    """Return the region state of a diagnostic_msgs/DiagnosticArray.

    Raises:
        MessageError: The status `region_state` or a value is missing, or no finite number.
    """
    status = next((s for s in message.status if s.name == STATE_NAME), None)
    if status is None:
        raise MessageError(f'status without the name {STATE_NAME}')
    values = diagnostic_values(status)
    number = {key: _number(values, key) for key in state_keys()}
    return state_from_parts(list(number.values()), region=status.message, level=status.level)


def state_from_parts(numbers: Sequence[float], *, region: str, level: bytes) -> RegionState:
    """Return a region state.

    Args:
        numbers: Memberships, pose and goal probability, in the order of `state_keys`.
        region: Name of the region.
        level: Level of the status.

    Raises:
        MessageError: No such region or level.
    """
    if level not in _CONFIDENCES:
        raise MessageError(f'level = {level!r}: must be OK, WARN or STALE')
    try:
        place = parse_region(region)
    except ConfigurationError as error:
        raise MessageError(str(error)) from None
    left, front, right, near, medium, far, x_m, y_m, heading_rad, goal_probability = numbers
    return RegionState(
        region=place,
        mu_x=(left, front, right),
        mu_y=(near, medium, far),
        pose=Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad),
        goal_probability=goal_probability,
        confidence=_CONFIDENCES[level],
    )


def state_keys() -> tuple[str, ...]:
    """Return the names of the numbers of a region state, in the order in which they are sent."""
    memberships = [f'mu_x.{label}' for label in X_LABELS] + [f'mu_y.{label}' for label in Y_LABELS]
    return (*memberships, 'x_m', 'y_m', 'heading_rad', 'goal_probability')


def state_numbers(state: RegionState) -> list[float]:
    """Return the numbers of a region state in the order of `state_keys`."""
    pose = state.pose
    place = (pose.x_m, pose.y_m, pose.heading_rad)
    return [float(value) for value in (*state.mu_x, *state.mu_y, *place, state.goal_probability)]


def diagnostic_values(status: DiagnosticStatus) -> dict[str, str]:
    """Return the key-value pairs of a status as a dictionary."""
    return {pair.key: pair.value for pair in status.values}


def _number(values: dict[str, str], key: str) -> float:
    if key not in values:
        raise MessageError(f'values without {key}')
    try:
        return require_finite(key, values[key])
    except ValueError:
        raise MessageError(f'{key} = {values[key]!r}: must be a number') from None
