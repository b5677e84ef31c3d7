"""Sensors and head as serialized messages, and back: see `pose_messages` for the conventions."""

from collections.abc import Sequence
from functools import lru_cache
import itertools
import math

from goalreach_msgs_py.camera import (
    DISTORTION_TERMS,
    EQUIDISTANT,
    PLUMB_BOB,
    RATIONAL,
    PinholeCamera,
)
from goalreach_msgs_py.cdr import CdrReader, CdrWriter, MessageError, with_stamp
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.pose_messages import require_finite
from goalreach_msgs_py.topics import BASE_FRAME, BUMPER_FRAME, CAMERA_FRAME, HEAD_JOINTS
from goalreach_msgs_py.values import HeadAngles, LandmarkObservation, Scan

_CACHED = 8
"""Messages that rarely change but for their stamp: the last few are kept. Chosen."""
_NOT_SEEN = (math.nan,) * 3


def clock_to_raw(stamp_ns: int) -> bytes:
    """Return the time as rosgraph_msgs/Clock."""
    return CdrWriter(stamp_ns).raw()


def camera_to_raw(camera: PinholeCamera, stamp_ns: int, prefix: str = '') -> bytes:
    """Return the intrinsics as sensor_msgs/CameraInfo."""
    return with_stamp(_write_camera(camera, prefix), stamp_ns)


@lru_cache(maxsize=_CACHED)
def _write_camera(camera: PinholeCamera, prefix: str) -> bytes:
    fx, fy, cx, cy = camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
    writer = CdrWriter(0, prefix + CAMERA_FRAME)
    writer.numbers('2I', camera.height_px, camera.width_px)
    writer.text(camera.distortion_model)
    writer.numbers('I', len(camera.distortion))
    writer.numbers(f'{len(camera.distortion)}d', *camera.distortion)
    writer.numbers('9d', fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
    writer.numbers('9d', 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    writer.numbers('12d', fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0)
    writer.zeros('6I')
    writer.zeros('B')
    return writer.raw()


def camera_from_raw(raw: bytes) -> PinholeCamera:
    """Return the intrinsics of a sensor_msgs/CameraInfo, those of the image as it is sent.

    K refers to the whole sensor. The image begins at the offset of `roi`, and each of its pixels
    is the mean of `binning_x` times `binning_y` pixels.

    Raises:
        MessageError: Intrinsics that no camera has, or an unknown distortion model.
    """
    return _read_camera(with_stamp(raw, 0))


@lru_cache(maxsize=_CACHED)
def _read_camera(raw: bytes) -> PinholeCamera:
    reader = CdrReader(raw)
    height, width = reader.numbers('2I')
    model = reader.text()
    terms = tuple(require_finite('d', term) for term in reader.sequence('d'))
    fx, _, cx, _, fy, cy, *_ = reader.numbers('9d')
    reader.skip('21d')
    across, down, left, top, rows, columns = reader.numbers('6I')
    across, down = max(across, 1), max(down, 1)
    model, terms = _distortion(model, terms)
    try:
        return PinholeCamera(
            width_px=(columns or width) // across,
            height_px=(rows or height) // down,
            fx_px=fx / across,
            fy_px=fy / down,
            cx_px=(cx - left - 0.5 * (across - 1)) / across,
            cy_px=(cy - top - 0.5 * (down - 1)) / down,
            distortion=terms,
            distortion_model=model,
        )
    except ConfigurationError as error:
        raise MessageError(str(error)) from None


def _distortion(model: str, terms: tuple[float, ...]) -> tuple[str, tuple[float, ...]]:
    """Return the model and its terms: by their number, since drivers name rational ones plumb_bob.

    Further terms of OpenCV (thin prism, tilt) must be zero; k3 may be left out.
    """
    if model not in {EQUIDISTANT, 'fisheye'}:
        if not any(terms):
            return PLUMB_BOB, (0.0,) * DISTORTION_TERMS[PLUMB_BOB]
        if model in {PLUMB_BOB, RATIONAL, ''}:
            terms = terms if any(terms[DISTORTION_TERMS[RATIONAL] :]) else terms[:8]
            model = RATIONAL if len(terms) > DISTORTION_TERMS[PLUMB_BOB] else PLUMB_BOB
            terms += (0.0,) * (len(terms) == DISTORTION_TERMS[EQUIDISTANT])
        return model, terms
    return EQUIDISTANT, terms


def head_to_raw(
    head: HeadAngles, stamp_ns: int, prefix: str = '', joints: Sequence[str] = HEAD_JOINTS
) -> bytes:
    """Return the angles of the joints that a head has as sensor_msgs/JointState."""
    angles = dict(zip(HEAD_JOINTS, vars(head).values(), strict=True))
    writer = CdrWriter(stamp_ns, prefix + BASE_FRAME)
    writer.numbers('I', len(joints))
    writer.text(*joints)
    writer.numbers('I', len(joints))
    writer.numbers(f'{len(joints)}d', *(angles[name] for name in joints))
    writer.zeros('2I')
    return writer.raw()


def head_from_raw(raw: bytes, joints: Sequence[str] = HEAD_JOINTS) -> HeadAngles:
    """Return the head's joint angles of a sensor_msgs/JointState, found by name.

    Joints that the head does not have are at zero.

    Raises:
        MessageError: A joint is missing or its position is not finite.
    """
    reader = CdrReader(raw)
    names = reader.texts(reader.count(least=5))
    positions = dict(zip(names, reader.sequence('d'), strict=False))
    missing = [name for name in joints if name not in positions]
    if missing:
        raise MessageError(f'name = {names}: {missing[0]} is missing')
    found = {name: require_finite(name, positions[name]) for name in joints}
    turret, pan, tilt = (found.get(name, 0.0) for name in HEAD_JOINTS)
    return HeadAngles(turret_rad=turret, pan_rad=pan, tilt_rad=tilt)


def joint_names_from_raw(raw: bytes) -> list[str]:
    """Return the names of the joints of a sensor_msgs/JointState."""
    reader = CdrReader(raw)
    return reader.texts(reader.count(least=5))


def bumpers_to_raw(
    pressed: Sequence[bool],
    stamp_ns: int,
    prefix: str = '',
    *,
    body_radius_m: float,
    scan_time_s: float,
) -> bytes:
    """Return 20 bumpers as sensor_msgs/LaserScan: the body radius where pressed, +inf where not.

    Sensor i points to 18 i degrees in `bumper_link`.
    """
    ranges_m = [body_radius_m if on else math.inf for on in pressed]
    limits_m = (0.0, 2.0 * body_radius_m)
    return sonar_to_raw(ranges_m, stamp_ns, prefix, limits_m=limits_m, scan_time_s=scan_time_s)


def sonar_to_raw(
    ranges_m: Sequence[float],
    stamp_ns: int,
    prefix: str = '',
    *,
    limits_m: tuple[float, float],
    scan_time_s: float,
) -> bytes:
    """Return the ring of ultrasonic sensors as sensor_msgs/LaserScan.

    Ranges count from the robot's axis, evenly spaced, the first to the front of `bumper_link`;
    they are infinite without an echo. `limits_m` are the smallest and the largest range.
    """
    count = len(ranges_m)
    step_rad = 2.0 * math.pi / count
    writer = CdrWriter(stamp_ns, prefix + BUMPER_FRAME)
    writer.numbers('7f', 0.0, step_rad * (count - 1), step_rad, 0.0, scan_time_s, *limits_m)
    writer.numbers('I', count)
    writer.numbers(f'{count}f', *ranges_m)
    writer.zeros('I')
    return writer.raw()


def scan_from_raw(raw: bytes) -> Scan:
    """Return a sensor_msgs/LaserScan, counter-clockwise.

    A range of no meaning becomes infinite, as without echo; one too short to measure (REP-117) is
    the shortest.

    Raises:
        MessageError: It cannot be read, or its bearings are not finite or all the same.
    """
    reader = CdrReader(raw, has_header=False)
    reader.skip('2I')
    frame = reader.text().rpartition('/')[2]
    first_rad, _, step_rad, _, _, nearest_m, farthest_m = reader.numbers('7f')
    for name, value in (('angle_min', first_rad), ('angle_increment', step_rad)):
        require_finite(name, value)
    if step_rad == 0.0:
        raise MessageError('angle_increment = 0: must be the angle from ray to ray')
    ranges_m = tuple(
        nearest_m if r == -math.inf else r if nearest_m <= r <= farthest_m else math.inf
        for r in reader.sequence('f')
    )
    if step_rad < 0.0:  # a scanner that turns clockwise, or hangs upside down
        first_rad, step_rad = first_rad + step_rad * (len(ranges_m) - 1), -step_rad
        ranges_m = ranges_m[::-1]
    return Scan(
        first_rad=first_rad, step_rad=step_rad, ranges_m=ranges_m, on_base=frame == BUMPER_FRAME
    )


def bumpers_from_raw(raw: bytes) -> tuple[bool, ...]:
    """Return which of the bumpers of a sensor_msgs/LaserScan are pressed, one for each ray.

    Raises:
        MessageError: There is no ray, or a ray is NaN.
    """
    reader = CdrReader(raw)
    reader.skip('7f')
    ranges = reader.sequence('f')
    if not ranges:
        raise MessageError('ranges has no rays: must be one for each bumper')
    if any(map(math.isnan, ranges)):
        raise MessageError('ranges holds NaN: must be a distance or +inf')
    return tuple(range_m != math.inf for range_m in ranges)


def landmarks_to_raw(
    landmarks: Sequence[LandmarkObservation | None], stamp_ns: int, prefix: str = ''
) -> bytes:
    """Return the seen LEDs as geometry_msgs/PolygonStamped: point i is (u, v, peak) of LED i."""
    points = (
        _NOT_SEEN if seen is None else (seen.u_px, seen.v_px, seen.peak_dn) for seen in landmarks
    )
    writer = CdrWriter(stamp_ns, prefix + CAMERA_FRAME)
    writer.numbers('I', len(landmarks))
    writer.numbers(f'{3 * len(landmarks)}f', *itertools.chain.from_iterable(points))
    return writer.raw()


def landmarks_from_raw(raw: bytes) -> tuple[LandmarkObservation | None, ...]:
    """Return the LEDs of a landmarks message (single precision); None where not finite.

    Raises:
        MessageError: It cannot be read.
    """
    reader = CdrReader(raw)
    points = (reader.numbers('3f') for _ in range(reader.count(least=12)))
    return tuple(
        LandmarkObservation(u_px=u, v_px=v, peak_dn=p) if math.isfinite(u + v) else None
        for u, v, p in points
    )
