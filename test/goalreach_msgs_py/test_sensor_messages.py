"""Sensors and head to messages and back, and messages that cannot be used."""

from collections.abc import Callable
import math
from typing import Any

from geometry_msgs.msg import PolygonStamped
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, JointState, LaserScan, RegionOfInterest

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.sensor_messages import (
    bumpers_from_raw,
    bumpers_to_raw,
    camera_from_raw,
    camera_to_raw,
    clock_to_raw,
    head_from_raw,
    head_to_raw,
    landmarks_from_raw,
    landmarks_to_raw,
)
from goalreach_msgs_py.topics import HEAD_KINDS
from goalreach_msgs_py.values import HeadAngles, LandmarkObservation
from ros_objects import as_object, by_others, changed

STAMP = 1_234_567_890_123
HEAD = HeadAngles(turret_rad=0.1, pan_rad=-0.2, tilt_rad=0.3)
JOINTS = head_to_raw(HEAD, STAMP)
PRESSED = tuple(index in (0, 19) for index in range(20))
BUMPERS = bumpers_to_raw(PRESSED, STAMP, body_radius_m=0.225, scan_time_s=0.04)
LENS = PinholeCamera(
    width_px=320,
    height_px=200,
    fx_px=500.0,
    fy_px=510.0,
    cx_px=160.0,
    cy_px=100.0,
    distortion=(0.1, 0.2, 0.3, 0.4, 0.5),
)
CAMERA = camera_to_raw(LENS, STAMP)


def test_clock() -> None:
    stamp = as_object(clock_to_raw(STAMP), Clock).clock
    assert (stamp.sec, stamp.nanosec) == (1234, 567890123)
    assert stamp_of(clock_to_raw(STAMP)) == STAMP


def test_camera() -> None:
    message = as_object(CAMERA, CameraInfo)
    assert message.k.tolist() == [500, 0, 160, 0, 510, 100, 0, 0, 1]
    assert message.p.tolist() == [500, 0, 160, 0, 0, 510, 100, 0, 0, 0, 1, 0]
    assert message.distortion_model == 'plumb_bob'
    for raw in by_others(CAMERA, CameraInfo):
        assert camera_from_raw(raw) == LENS


def test_camera_without_distortion() -> None:
    assert camera_from_raw(changed(CAMERA, CameraInfo, d=[])).distortion == (0.0,) * 5


@pytest.mark.parametrize(
    ('sent', 'terms', 'model', 'expected'),
    [
        ('plumb_bob', (0.1, 0.2, 0.3, 0.4), 'plumb_bob', (0.1, 0.2, 0.3, 0.4, 0.0)),
        ('', (0.1, 0.2, 0.3, 0.4, 0.5), 'plumb_bob', (0.1, 0.2, 0.3, 0.4, 0.5)),
        ('rational_polynomial', (0.1,) * 8, 'rational_polynomial', (0.1,) * 8),
        ('plumb_bob', (0.1,) * 8, 'rational_polynomial', (0.1,) * 8),
        ('rational_polynomial', (0.1,) * 8 + (0.0,) * 6, 'rational_polynomial', (0.1,) * 8),
        ('equidistant', (0.1, 0.2, 0.3, 0.4), 'equidistant', (0.1, 0.2, 0.3, 0.4)),
        ('fisheye', (0.0,) * 4, 'equidistant', (0.0,) * 4),
        ('of nobody', (0.0,) * 5, 'plumb_bob', (0.0,) * 5),
    ],
)
def test_lenses_of_every_model(
    sent: str, terms: tuple[float, ...], model: str, expected: tuple[float, ...]
) -> None:
    camera = camera_from_raw(changed(CAMERA, CameraInfo, distortion_model=sent, d=terms))
    assert (camera.distortion_model, camera.distortion) == (model, expected)
    assert camera_from_raw(camera_to_raw(camera, STAMP)) == camera


@pytest.mark.parametrize(
    ('model', 'terms'), [('equidistant', 5), ('rational_polynomial', 12), ('of nobody', 5)]
)
def test_lenses_of_unknown_models_are_refused(model: str, terms: int) -> None:
    with pytest.raises(MessageError, match='distortion'):
        camera_from_raw(changed(CAMERA, CameraInfo, distortion_model=model, d=(0.1,) * terms))


def test_binning_and_region_of_interest() -> None:
    # Columns 40 to 239, two by two: the centre of column 160 is 120 to the right of that of
    # column 40, which is a quarter of the new pixel left of the centre of the first.
    roi = RegionOfInterest(x_offset=40, y_offset=8, width=200, height=160)
    camera = camera_from_raw(changed(CAMERA, CameraInfo, roi=roi, binning_x=2, binning_y=4))
    assert (camera.width_px, camera.height_px) == (100, 40)
    assert (camera.fx_px, camera.fy_px) == (250.0, 127.5)
    assert (camera.cx_px, camera.cy_px) == (59.75, 22.625)


@pytest.mark.parametrize('k0', [0.0, -1.0, math.nan])
def test_camera_without_focal_length_is_refused(k0: float) -> None:
    k = [k0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    with pytest.raises(MessageError, match='fx_px'):
        camera_from_raw(changed(CAMERA, CameraInfo, k=k))


def test_head_is_found_by_joint_name() -> None:
    assert as_object(JOINTS, JointState).name == ['turret_joint', 'pan_joint', 'tilt_joint']
    names = ['wheel', 'tilt_joint', 'turret_joint', 'pan_joint']
    shuffled = changed(JOINTS, JointState, name=names, position=[9.0, 0.3, 0.1, -0.2])
    for raw in (*by_others(JOINTS, JointState), shuffled):
        assert head_from_raw(raw) == HEAD


@pytest.mark.parametrize(
    ('change', 'reason'),
    [
        ({'name': ['pan_joint', 'tilt_joint'], 'position': [0.0, 0.0]}, 'turret_joint is missing'),
        ({'position': [0.0, math.nan, 0.0]}, 'pan_joint = nan'),
        ({'position': [0.0]}, 'pan_joint is missing'),
    ],
)
def test_head_without_all_joints_is_refused(change: dict[str, Any], reason: str) -> None:
    with pytest.raises(MessageError, match=reason):
        head_from_raw(changed(JOINTS, JointState, **change))


def test_bumpers_are_ranges_at_the_body_radius() -> None:
    message = as_object(BUMPERS, LaserScan)
    assert message.header.frame_id == 'bumper_link'
    assert message.angle_increment == pytest.approx(math.radians(18))
    assert message.angle_max == pytest.approx(math.radians(342))
    assert message.scan_time == pytest.approx(0.04)
    assert message.ranges[0] == pytest.approx(0.225)
    assert message.ranges[1] == math.inf
    for raw in by_others(BUMPERS, LaserScan):
        assert bumpers_from_raw(raw) == PRESSED


@pytest.mark.parametrize('rays', [1, 6, 360])
def test_bumpers_of_any_number(rays: int) -> None:
    ranges = [0.2 if ray == rays - 1 else math.inf for ray in range(rays)]
    pressed = bumpers_from_raw(changed(BUMPERS, LaserScan, ranges=ranges))
    assert pressed == (*(False,) * (rays - 1), True)


def test_joints_that_a_head_lacks_are_at_zero() -> None:
    names = ['left_wheel_joint', 'tilt_joint', 'pan_joint']
    raw = changed(JOINTS, JointState, name=names, position=[9.0, 0.3, -0.2])
    head = head_from_raw(raw, HEAD_KINDS['pan_tilt'])
    assert head == HeadAngles(turret_rad=0.0, pan_rad=-0.2, tilt_rad=0.3)
    assert head_from_raw(raw, HEAD_KINDS['pan']).tilt_rad == 0.0
    command = as_object(head_to_raw(HEAD, STAMP, joints=HEAD_KINDS['pan_tilt']), JointState)
    assert (command.name, command.position.tolist()) == (['pan_joint', 'tilt_joint'], [-0.2, 0.3])


@pytest.mark.parametrize('ranges', [[], [math.nan] * 20])
def test_bumpers_of_another_kind_are_refused(ranges: list[float]) -> None:
    with pytest.raises(MessageError, match='ranges'):
        bumpers_from_raw(changed(BUMPERS, LaserScan, ranges=ranges))


def test_landmarks_not_seen_are_nan() -> None:
    seen = LandmarkObservation(u_px=1.5, v_px=2.5, peak_dn=200.0)
    raw = landmarks_to_raw([None, seen, None], STAMP)
    points = as_object(raw, PolygonStamped).polygon.points
    assert math.isnan(points[0].x)
    assert (points[1].x, points[1].y, points[1].z) == (1.5, 2.5, 200.0)
    for each in by_others(raw, PolygonStamped):
        assert landmarks_from_raw(each) == (None, seen, None)


def test_landmarks_at_infinity_are_not_seen() -> None:
    places = ((math.inf, 1.0), (1.0, -math.inf), (-math.inf, math.inf))
    seen = [LandmarkObservation(u_px=u, v_px=v, peak_dn=200.0) for u, v in places]
    assert landmarks_from_raw(landmarks_to_raw(seen, STAMP)) == (None, None, None)


@pytest.mark.parametrize(
    ('reader', 'raw'),
    [
        (camera_from_raw, CAMERA),
        (head_from_raw, JOINTS),
        (bumpers_from_raw, BUMPERS),
        (landmarks_from_raw, landmarks_to_raw([None] * 3, STAMP)),
    ],
)
def test_what_is_cut_off_is_refused(reader: Callable[[bytes], object], raw: bytes) -> None:
    for size in range(0, len(raw) - 8, 7):
        with pytest.raises(MessageError):
            reader(raw[:size])
