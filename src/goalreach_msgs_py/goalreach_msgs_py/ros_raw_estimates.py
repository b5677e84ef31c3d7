"""What perception sends, as bytes: the pairs of `ros_estimate_messages`, quicker.

`x_to_raw` gives the bytes of `x_to_msg`; `x_from_raw` gives, or refuses, what `x_from_msg` does.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
import itertools
import math

from geometry_msgs.msg import PoseWithCovarianceStamped

from goalreach_msgs_py.cdr import CdrLayout, Fixed, Run
from goalreach_msgs_py.ros_common_messages import pose_from_numbers, pose_to_numbers
from goalreach_msgs_py.ros_estimate_messages import (
    PLANAR,
    estimate_from_msg,
    planar_covariance,
)
from goalreach_msgs_py.ros_raw import read_message
from goalreach_msgs_py.topics import CAMERA_FRAME, MAP_FRAME
from goalreach_msgs_py.values import LandmarkObservation, PoseEstimate

__all__ = [
    'estimate_from_raw',
    'estimate_to_raw',
    'landmarks_to_raw',
]

_KEPT = 4
_POSE_NUMBERS = 7
_PLACES = [6 * i + j for i in PLANAR for j in PLANAR]
_NOT_SEEN = (math.nan,) * 3


def estimate_to_raw(estimate: PoseEstimate, stamp_ns: int) -> bytes:
    """Return an estimate as geometry_msgs/PoseWithCovarianceStamped in `map`."""
    covariance = [0.0] * 36
    for place, value in zip(_PLACES, estimate.covariance.ravel().tolist(), strict=True):
        covariance[place] = value
    return _estimate_layout().pack(stamp_ns, (*pose_to_numbers(estimate.pose), *covariance))


@lru_cache(maxsize=1)
def _estimate_layout() -> CdrLayout:
    return CdrLayout(MAP_FRAME, Run('43d'))


def estimate_from_raw(raw: bytes) -> PoseEstimate:
    """Return the planar estimate of a geometry_msgs/PoseWithCovarianceStamped.

    Raises:
        MessageError: A number is not finite, or a variance is negative.
    """
    layout = _estimate_layout()
    if not layout.fits(raw):
        return estimate_from_msg(read_message(raw, PoseWithCovarianceStamped))
    numbers = layout.unpack(raw)
    return PoseEstimate(
        pose=pose_from_numbers(numbers[:_POSE_NUMBERS]),
        covariance=planar_covariance(numbers[_POSE_NUMBERS:]),
    )


def landmarks_to_raw(landmarks: Sequence[LandmarkObservation | None], stamp_ns: int) -> bytes:
    """Return the seen LEDs as geometry_msgs/PolygonStamped: point i is (u, v, peak) of LED i."""
    points = (
        _NOT_SEEN if seen is None else (seen.u_px, seen.v_px, seen.peak_dn) for seen in landmarks
    )
    numbers = itertools.chain.from_iterable(points)
    return _landmark_layout(len(landmarks)).pack(stamp_ns, numbers)


@lru_cache(maxsize=_KEPT)
def _landmark_layout(count: int) -> CdrLayout:
    return CdrLayout(CAMERA_FRAME, Fixed('I', count), Run(f'{3 * count}f'))
