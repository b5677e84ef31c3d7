"""Sensors and head to messages and back, and messages that cannot be used."""

from array import array
from collections.abc import Callable
import math
from typing import Any

from geometry_msgs.msg import PolygonStamped
import numpy as np
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, LaserScan

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.sensor_messages import (
    bumpers_from_raw,
    bumpers_to_raw,
    camera_from_raw,
    camera_to_raw,
    clock_to_raw,
    compressed_image_from_raw,
    compressed_image_to_raw,
    head_from_raw,
    head_to_raw,
    image_from_raw,
    image_to_raw,
    landmarks_from_raw,
    landmarks_to_raw,
)
from goalreach_msgs_py.values import HeadAngles, LandmarkObservation
from ros_objects import as_object, by_others, changed

STAMP = 1_234_567_890_123
PIXELS = np.arange(12, dtype=np.uint8).reshape(3, 4)
IMAGE = image_to_raw(PIXELS, STAMP)
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


def test_image() -> None:
    message = as_object(IMAGE, Image)
    assert (message.width, message.height, message.step, message.encoding) == (4, 3, 4, 'mono8')
    assert message.header.frame_id == 'camera_optical_frame'
    for raw in by_others(IMAGE, Image):
        assert image_from_raw(raw).tolist() == PIXELS.tolist()


def test_image_of_every_second_column() -> None:
    assert (image_from_raw(image_to_raw(PIXELS[:, ::2], STAMP)) == PIXELS[:, ::2]).all()


def test_image_with_padding() -> None:
    raw = changed(IMAGE, Image, width=3)
    assert image_from_raw(raw).tolist() == [[0, 1, 2], [4, 5, 6], [8, 9, 10]]


def test_image_shares_the_memory_of_its_message() -> None:
    assert not image_from_raw(IMAGE).flags.owndata


@pytest.mark.parametrize(
    'change', [{'encoding': 'rgb8'}, {'width': 5}, {'height': 2}, {'step': 3}, {'width': 0}]
)
def test_image_that_does_not_fit_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(MessageError, match=r'encoding|do not fit'):
        image_from_raw(changed(IMAGE, Image, **change))


def test_compressed_image() -> None:
    raw = compressed_image_to_raw(b'\xff\xd8jpeg', STAMP)
    message = as_object(raw, CompressedImage)
    assert (message.format, message.data) == ('jpeg', array('B', b'\xff\xd8jpeg'))
    for each in by_others(raw, CompressedImage):
        assert compressed_image_from_raw(each) == b'\xff\xd8jpeg'


def test_camera() -> None:
    message = as_object(CAMERA, CameraInfo)
    assert message.k.tolist() == [500, 0, 160, 0, 510, 100, 0, 0, 1]
    assert message.p.tolist() == [500, 0, 160, 0, 0, 510, 100, 0, 0, 0, 1, 0]
    assert message.distortion_model == 'plumb_bob'
    for raw in by_others(CAMERA, CameraInfo):
        assert camera_from_raw(raw) == LENS


def test_camera_without_distortion() -> None:
    assert camera_from_raw(changed(CAMERA, CameraInfo, d=[])).distortion == (0.0,) * 5


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


@pytest.mark.parametrize('ranges', [[], [1.0] * 19, [math.nan] * 20])
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


@pytest.mark.parametrize(
    ('reader', 'raw'),
    [
        (image_from_raw, IMAGE),
        (camera_from_raw, CAMERA),
        (head_from_raw, JOINTS),
        (bumpers_from_raw, BUMPERS),
        (compressed_image_from_raw, compressed_image_to_raw(bytes(20), STAMP)),
        (landmarks_from_raw, landmarks_to_raw([None] * 3, STAMP)),
    ],
)
def test_what_is_cut_off_is_refused(reader: Callable[[bytes], object], raw: bytes) -> None:
    for size in range(0, len(raw) - 8, 7):
        with pytest.raises(MessageError):
            reader(raw[:size])
