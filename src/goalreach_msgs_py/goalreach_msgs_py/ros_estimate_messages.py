"""What perception sends: pose, landmarks and region state as messages and back."""

from __future__ import annotations

from collections.abc import Sequence
import math

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point32, PolygonStamped, PoseWithCovarianceStamped
import numpy as np

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS, parse_region, region_name
from goalreach_msgs_py.ros_common_messages import (
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
    LandmarkObservation,
    Pose2,
    PoseEstimate,
    RegionState,
)

__all__ = [
    'STATE_NAME',
    'diagnostic_values',
    'estimate_from_msg',
    'estimate_to_msg',
    'landmarks_from_msg',
    'landmarks_to_msg',
    'state_from_msg',
    'state_to_msg',
]

STATE_NAME = 'region_state'
_PLANAR = (0, 1, 5)
"""Rows of x, y and yaw in the 6 x 6 covariance of geometry_msgs (REP-103 order)."""

_LEVELS = {
    Confidence.OK: DiagnosticStatus.OK,
    Confidence.UNCERTAIN: DiagnosticStatus.WARN,
    Confidence.STALE: DiagnosticStatus.STALE,
}


def estimate_to_msg(estimate: PoseEstimate, stamp_ns: int) -> PoseWithCovarianceStamped:
    """Return an estimate as geometry_msgs/PoseWithCovarianceStamped in `map`."""
    message = PoseWithCovarianceStamped(header=header(stamp_ns, MAP_FRAME))
    message.pose.pose = pose_to_msg(estimate.pose)
    covariance = np.zeros((6, 6))
    covariance[np.ix_(_PLANAR, _PLANAR)] = estimate.covariance
    message.pose.covariance = covariance.ravel()
    return message


def estimate_from_msg(message: PoseWithCovarianceStamped) -> PoseEstimate:
    """Return the planar estimate of a geometry_msgs/PoseWithCovarianceStamped.

    Raises:
        MessageError: A number is not finite, or a variance is negative.
    """
    covariance = np.asarray(message.pose.covariance, dtype=np.float64).reshape(6, 6)
    planar = covariance[np.ix_(_PLANAR, _PLANAR)]
    if not np.isfinite(planar).all() or (np.diag(planar) < 0).any():
        diagonal = np.diag(planar).tolist()
        raise MessageError(f'covariance with diagonal {diagonal}: must be finite, not negative')
    return PoseEstimate(pose=pose_from_msg(message.pose.pose), covariance=planar)


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
    values = {f'mu_x.{name}': mu for name, mu in zip(X_LABELS, state.mu_x, strict=True)}
    values |= {f'mu_y.{name}': mu for name, mu in zip(Y_LABELS, state.mu_y, strict=True)}
    values |= {
        'x_m': state.pose.x_m,
        'y_m': state.pose.y_m,
        'heading_rad': state.pose.heading_rad,
        'goal_probability': state.goal_probability,
    }
    status = DiagnosticStatus(
        level=_LEVELS[state.confidence],
        name=STATE_NAME,
        message=region_name(state.region),
        hardware_id='state_estimator',
        values=[KeyValue(key=key, value=repr(float(value))) for key, value in values.items()],
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
    number = {key: _number(values, key) for key in _state_keys()}
    confidences = {level: confidence for confidence, level in _LEVELS.items()}
    if status.level not in confidences:
        raise MessageError(f'level = {status.level!r}: must be OK, WARN or STALE')
    try:
        region = parse_region(status.message)
    except ConfigurationError as error:
        raise MessageError(str(error)) from None
    mu_x = [number[f'mu_x.{label}'] for label in X_LABELS]
    mu_y = [number[f'mu_y.{label}'] for label in Y_LABELS]
    return RegionState(
        region=region,
        mu_x=(mu_x[0], mu_x[1], mu_x[2]),
        mu_y=(mu_y[0], mu_y[1], mu_y[2]),
        pose=Pose2(x_m=number['x_m'], y_m=number['y_m'], heading_rad=number['heading_rad']),
        goal_probability=number['goal_probability'],
        confidence=confidences[status.level],
    )


def _state_keys() -> tuple[str, ...]:
    memberships = [f'mu_x.{label}' for label in X_LABELS] + [f'mu_y.{label}' for label in Y_LABELS]
    return (*memberships, 'x_m', 'y_m', 'heading_rad', 'goal_probability')


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
