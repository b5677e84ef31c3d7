"""Sensors and head as serialized messages, and back: see `pose_messages` for the conventions."""

from collections.abc import Sequence
from functools import lru_cache
import itertools
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.cdr import CdrReader, CdrWriter, MessageError, with_stamp
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.pose_messages import require_finite
from goalreach_msgs_py.topics import BASE_FRAME, BUMPER_FRAME, CAMERA_FRAME, HEAD_JOINTS
from goalreach_msgs_py.values import HeadAngles, LandmarkObservation

_GREY = 'mono8'
_BUMPERS = 20
_DISTORTION_TERMS = 5
_CACHED = 8
"""Messages that rarely change but for their stamp: the last few are kept. Chosen."""
_NOT_SEEN = (math.nan,) * 3


def clock_to_raw(stamp_ns: int) -> bytes:
    """Return the time as rosgraph_msgs/Clock."""
    return CdrWriter(stamp_ns).raw()


def image_to_raw(image: NDArray[np.uint8], stamp_ns: int) -> bytes:
    """Return a (height, width) grey image as sensor_msgs/Image mono8."""
    height, width = image.shape
    writer = CdrWriter(stamp_ns, CAMERA_FRAME)
    writer.numbers('2I', height, width)
    writer.text(_GREY)
    writer.zeros('B')
    writer.numbers('2I', width, height * width)
    return writer.raw(image.data if image.flags.c_contiguous else image.tobytes())


def image_from_raw(raw: bytes) -> NDArray[np.uint8]:
    """Return a sensor_msgs/Image mono8 as a (height, width) array that shares its memory.

    Raises:
        MessageError: Another encoding, or sizes that do not fit the data.
    """
    reader = CdrReader(raw)
    height, width = reader.numbers('2I')
    encoding = reader.text()
    if encoding != _GREY:
        raise MessageError(f'encoding = {encoding!r}: must be {_GREY}')
    reader.skip('B')
    (step,) = reader.numbers('I')
    data = reader.data()
    if step < width or height * step != len(data) or 0 in (height, width):
        size = f'{width} x {height}, step {step}, {len(data)} bytes'
        raise MessageError(f'image of {size}: sizes do not fit one another')
    return np.frombuffer(data, np.uint8).reshape(height, step)[:, :width]


def compressed_image_to_raw(encoded: bytes, stamp_ns: int) -> bytes:
    """Return a JPEG image as sensor_msgs/CompressedImage."""
    writer = CdrWriter(stamp_ns, CAMERA_FRAME)
    writer.text('jpeg')
    writer.numbers('I', len(encoded))
    return writer.raw(encoded)


def compressed_image_from_raw(raw: bytes) -> bytes:
    """Return the encoded image of a sensor_msgs/CompressedImage.

    Raises:
        MessageError: It cannot be read.
    """
    reader = CdrReader(raw)
    reader.skip_text()
    return bytes(reader.data())


def camera_to_raw(camera: PinholeCamera, stamp_ns: int) -> bytes:
    """Return the intrinsics as sensor_msgs/CameraInfo, model plumb_bob."""
    return with_stamp(_write_camera(camera), stamp_ns)


@lru_cache(maxsize=_CACHED)
def _write_camera(camera: PinholeCamera) -> bytes:
    fx, fy, cx, cy = camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
    writer = CdrWriter(0, CAMERA_FRAME)
    writer.numbers('2I', camera.height_px, camera.width_px)
    writer.text('plumb_bob')
    writer.numbers('I', _DISTORTION_TERMS)
    writer.numbers('5d', *camera.distortion)
    writer.numbers('9d', fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
    writer.numbers('9d', 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    writer.numbers('12d', fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0)
    writer.zeros('6I')
    writer.zeros('B')
    return writer.raw()


def camera_from_raw(raw: bytes) -> PinholeCamera:
    """Return the intrinsics of a sensor_msgs/CameraInfo.

    Raises:
        MessageError: Intrinsics that no camera has, or a distortion model other than plumb_bob.
    """
    return _read_camera(with_stamp(raw, 0))


@lru_cache(maxsize=_CACHED)
def _read_camera(raw: bytes) -> PinholeCamera:
    reader = CdrReader(raw)
    height, width = reader.numbers('2I')
    reader.skip_text()
    distortion = [require_finite('d', term) for term in reader.sequence('d')]
    if len(distortion) not in (0, _DISTORTION_TERMS):
        raise MessageError(f'd = {distortion}: must be 5 numbers or none')
    k1, k2, p1, p2, k3 = distortion or [0.0] * _DISTORTION_TERMS
    fx, _, cx, _, fy, cy, *_ = reader.numbers('9d')
    reader.skip('21d')
    reader.skip('6I')
    try:
        return PinholeCamera(
            width_px=width,
            height_px=height,
            fx_px=fx,
            fy_px=fy,
            cx_px=cx,
            cy_px=cy,
            distortion=(k1, k2, p1, p2, k3),
        )
    except ConfigurationError as error:
        raise MessageError(str(error)) from None


def head_to_raw(head: HeadAngles, stamp_ns: int) -> bytes:
    """Return the three joint angles as sensor_msgs/JointState."""
    writer = CdrWriter(stamp_ns, BASE_FRAME)
    writer.numbers('I', len(HEAD_JOINTS))
    writer.text(*HEAD_JOINTS)
    writer.numbers('I', len(HEAD_JOINTS))
    writer.numbers('3d', head.turret_rad, head.pan_rad, head.tilt_rad)
    writer.zeros('2I')
    return writer.raw()


def head_from_raw(raw: bytes) -> HeadAngles:
    """Return the head's joint angles of a sensor_msgs/JointState, found by name.

    Raises:
        MessageError: A joint is missing or its position is not finite.
    """
    reader = CdrReader(raw)
    names = reader.texts(reader.count(least=5))
    positions = dict(zip(names, reader.sequence('d'), strict=False))
    missing = [name for name in HEAD_JOINTS if name not in positions]
    if missing:
        raise MessageError(f'name = {names}: {missing[0]} is missing')
    turret, pan, tilt = (require_finite(name, positions[name]) for name in HEAD_JOINTS)
    return HeadAngles(turret_rad=turret, pan_rad=pan, tilt_rad=tilt)


def bumpers_to_raw(
    pressed: Sequence[bool], stamp_ns: int, *, body_radius_m: float, scan_time_s: float
) -> bytes:
    """Return 20 bumpers as sensor_msgs/LaserScan: the body radius where pressed, +inf where not.

    Args:
        pressed: (20,) by sensor; sensor i points to 18 i degrees in `bumper_link`.
        stamp_ns: Stamp, nanoseconds.
        body_radius_m: Radius of the bumper ring.
        scan_time_s: Time between readings.
    """
    return with_stamp(_write_bumpers(tuple(pressed), body_radius_m, scan_time_s), stamp_ns)


@lru_cache(maxsize=_CACHED)
def _write_bumpers(pressed: tuple[bool, ...], body_radius_m: float, scan_time_s: float) -> bytes:
    step_rad = 2.0 * math.pi / _BUMPERS
    writer = CdrWriter(0, BUMPER_FRAME)
    writer.numbers('3f', 0.0, step_rad * (_BUMPERS - 1), step_rad)
    writer.numbers('2f', 0.0, scan_time_s)
    writer.numbers('2f', 0.0, 2.0 * body_radius_m)
    writer.numbers('I', _BUMPERS)
    writer.numbers(f'{_BUMPERS}f', *(body_radius_m if on else math.inf for on in pressed))
    writer.zeros('I')
    return writer.raw()


def bumpers_from_raw(raw: bytes) -> tuple[bool, ...]:
    """Return which of the bumpers of a sensor_msgs/LaserScan are pressed.

    Raises:
        MessageError: There are not 20 rays, or a ray is NaN.
    """
    return _read_bumpers(with_stamp(raw, 0))


@lru_cache(maxsize=_CACHED)
def _read_bumpers(raw: bytes) -> tuple[bool, ...]:
    reader = CdrReader(raw)
    reader.skip('7f')
    ranges = reader.sequence('f')
    if len(ranges) != _BUMPERS:
        raise MessageError(f'ranges has {len(ranges)} rays: must be {_BUMPERS}')
    if any(map(math.isnan, ranges)):
        raise MessageError('ranges holds NaN: must be a distance or +inf')
    return tuple(map(math.isfinite, ranges))


def landmarks_to_raw(landmarks: Sequence[LandmarkObservation | None], stamp_ns: int) -> bytes:
    """Return the seen LEDs as geometry_msgs/PolygonStamped: point i is (u, v, peak) of LED i."""
    points = (
        _NOT_SEEN if seen is None else (seen.u_px, seen.v_px, seen.peak_dn) for seen in landmarks
    )
    writer = CdrWriter(stamp_ns, CAMERA_FRAME)
    writer.numbers('I', len(landmarks))
    writer.numbers(f'{3 * len(landmarks)}f', *itertools.chain.from_iterable(points))
    return writer.raw()


def landmarks_from_raw(raw: bytes) -> tuple[LandmarkObservation | None, ...]:
    """Return the LEDs of a landmarks message (single precision); None where NaN.

    Raises:
        MessageError: It cannot be read.
    """
    reader = CdrReader(raw)
    points = (reader.numbers('3f') for _ in range(reader.count(least=12)))
    return tuple(
        None if math.isnan(u) or math.isnan(v) else LandmarkObservation(u_px=u, v_px=v, peak_dn=p)
        for u, v, p in points
    )
