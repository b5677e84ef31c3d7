"""The region state as bytes: the pair of `ros_estimate_messages`, quicker.

Its numbers are texts of any length, so it is put together and taken apart text by text.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
import itertools
import math
import struct

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped

from goalreach_msgs_py.cdr import (
    LITTLE_ENDIAN,
    STAMP_END,
    CdrLayout,
    Fixed,
    Run,
    pack_text,
    set_stamp,
)
from goalreach_msgs_py.regions import region_name
from goalreach_msgs_py.ros.common_messages import pose_from_numbers, pose_to_numbers
from goalreach_msgs_py.ros.estimate_messages import (
    LEVELS,
    PLANAR,
    STATE_NAME,
    STATE_SENDER,
    estimate_from_msg,
    planar_covariance,
    state_from_msg,
    state_from_parts,
    state_keys,
    state_numbers,
)
from goalreach_msgs_py.ros.subscribe_raw import read_message
from goalreach_msgs_py.topics import CAMERA_FRAME, MAP_FRAME
from goalreach_msgs_py.values import LandmarkObservation, PoseEstimate, RegionState

_LENGTH = struct.Struct('<I')
_ONE_STATUS = _LENGTH.pack(1)
_LEVEL_BYTES = 4
"""The level is one byte, and the text after it begins at a multiple of four."""


@lru_cache(maxsize=1)
def _frame() -> bytes:
    """Return what is between stamp and level."""
    return pack_text(MAP_FRAME) + _ONE_STATUS


@lru_cache(maxsize=1)
def _name() -> bytes:
    """Return what is between level and region."""
    return pack_text(STATE_NAME)


@lru_cache(maxsize=1)
def _sender() -> bytes:
    """Return what is between region and values."""
    return pack_text(STATE_SENDER) + _LENGTH.pack(len(state_keys()))


@lru_cache(maxsize=1)
def _keys() -> tuple[bytes, ...]:
    return tuple(map(pack_text, state_keys()))


def state_to_raw(state: RegionState, stamp_ns: int) -> bytes:
    """Return a region state as diagnostic_msgs/DiagnosticArray; see `state_to_msg`."""
    start = bytearray(LITTLE_ENDIAN.ljust(STAMP_END, b'\0'))
    set_stamp(start, stamp_ns)
    level = LEVELS[state.confidence].ljust(_LEVEL_BYTES, b'\0')
    parts = [start, _frame(), level, _name(), pack_text(region_name(state.region)), _sender()]
    numbers = [repr(number) for number in state_numbers(state)]
    for key, number in zip(_keys(), numbers, strict=True):
        parts += (key, pack_text(number))
    unused = 3 - len(numbers[-1]) % 4  # nothing follows that would have to be aligned
    return b''.join(parts)[: -unused or None]


def state_from_raw(raw: bytes) -> RegionState:
    """Return the region state of a diagnostic_msgs/DiagnosticArray.

    Raises:
        MessageError: The status `region_state` or a value is missing, or no finite number.
    """
    try:
        return _read(raw)
    except (ValueError, struct.error):  # not as ours is
        return state_from_msg(read_message(raw, DiagnosticArray))


def _read(raw: bytes) -> RegionState:
    at = _after(raw, 0, LITTLE_ENDIAN) + STAMP_END - len(LITTLE_ENDIAN)
    at = _after(raw, at, _frame())
    level = raw[at : at + 1]
    at = _after(raw, at + _LEVEL_BYTES, _name())
    region, at = _next_text(raw, at)
    at = _after(raw, at, _sender())
    numbers = []
    for key in _keys():
        number, at = _next_text(raw, _after(raw, at, key))
        numbers.append(float(number))
    if not all(map(math.isfinite, numbers)):
        raise ValueError('not finite')
    return state_from_parts(numbers, region=region.decode(), level=level)


def _after(raw: bytes, at: int, expected: bytes) -> int:
    """Return the place after what is expected at a place."""
    if not raw.startswith(expected, at):
        raise ValueError('not what is expected')
    return at + len(expected)


def _next_text(raw: bytes, at: int) -> tuple[bytes, int]:
    """Return the text at a place, and the place after it."""
    (size,) = _LENGTH.unpack_from(raw, at)
    begin = at + _LENGTH.size
    text = raw[begin : begin + size - 1]
    if size < 1 or len(text) != size - 1:
        raise ValueError('cut off')
    return text, begin + (size + 3) // 4 * 4


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
