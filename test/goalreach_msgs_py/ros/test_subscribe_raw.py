"""Messages as bytes against the same messages made and read by rclpy."""

from __future__ import annotations

from collections.abc import Callable
import copy
from functools import partial
import math
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
import rclpy
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.ros.common_messages import MessageError, stamp_to_msg, twist_to_msg
from goalreach_msgs_py.ros.estimate_messages import estimate_to_msg, landmarks_to_msg, state_to_msg
from goalreach_msgs_py.ros.raw_camera import (
    camera_from_raw,
    camera_to_raw,
    image_from_raw,
    image_to_raw,
)
from goalreach_msgs_py.ros.raw_estimates import (
    estimate_from_raw,
    estimate_to_raw,
    landmarks_to_raw,
    state_from_raw,
    state_to_raw,
)
from goalreach_msgs_py.ros.raw_robot import (
    bumpers_from_raw,
    bumpers_to_raw,
    clock_to_raw,
    head_from_raw,
    head_to_raw,
    odometry_from_raw,
    odometry_to_raw,
    twist_from_raw,
    twist_to_raw,
)
from goalreach_msgs_py.ros.sensor_messages import (
    bumpers_to_msg,
    camera_to_msg,
    head_to_msg,
    image_to_msg,
    odometry_to_msg,
)
from goalreach_msgs_py.ros.subscribe_raw import RELIABLE_QOS, subscribe_raw
from goalreach_msgs_py.values import (
    Confidence,
    HeadAngles,
    LandmarkObservation,
    Odometry,
    Pose2,
    PoseEstimate,
    RegionState,
    Twist2,
)
from graphs import fresh_domain

STAMP = 1_234_567_890_123
METRES = st.floats(-100.0, 100.0)
POSES = st.builds(Pose2, x_m=METRES, y_m=METRES, heading_rad=st.floats(-3.14, 3.14))
MEMBERSHIPS = st.tuples(*[st.floats(0.0, 1.0)] * 3)
STATES = st.builds(
    RegionState,
    region=st.tuples(st.integers(0, 2), st.integers(0, 2)),
    mu_x=MEMBERSHIPS,
    mu_y=MEMBERSHIPS,
    pose=POSES,
    goal_probability=st.floats(0.0, 1.0),
    confidence=st.sampled_from(Confidence),
)
POSE = Pose2(x_m=1.5, y_m=-2.5, heading_rad=0.75)
TWIST = Twist2(linear_m_per_s=0.25, steering_rad_per_s=-0.5)
ODOMETRY = Odometry(pose=POSE, twist=TWIST)
HEAD = HeadAngles(turret_rad=0.1, pan_rad=-0.2, tilt_rad=0.3)
COVARIANCE = np.array([[3.0, 0.1, 0.2], [0.1, 2.0, 0.3], [0.2, 0.3, 1.0]])
ESTIMATE = PoseEstimate(pose=POSE, covariance=COVARIANCE)
SEEN = LandmarkObservation(u_px=1.5, v_px=2.5, peak_dn=200.0)
RADIUS = {'body_radius_m': 0.225, 'scan_time_s': 0.04}
PRESSED = tuple(index in (0, 19) for index in range(20))
PIXELS = np.arange(12, dtype=np.uint8).reshape(3, 4)
CAMERA = PinholeCamera(
    width_px=320,
    height_px=200,
    fx_px=500.0,
    fy_px=510.0,
    cx_px=160.0,
    cy_px=100.0,
    distortion=(0.1, 0.2, 0.3, 0.4, 0.5),
)
STATE = RegionState(
    region=(1, 0),
    mu_x=(0.1, 0.9, 0.0),
    mu_y=(1.0, 0.0, 0.0),
    pose=POSE,
    goal_probability=0.5,
    confidence=Confidence.UNCERTAIN,
)
PAIRS: dict[str, tuple[bytes, Any]] = {
    'clock': (clock_to_raw(STAMP), Clock(clock=stamp_to_msg(STAMP))),
    'image': (image_to_raw(PIXELS, STAMP), image_to_msg(PIXELS, STAMP)),
    'columns': (image_to_raw(PIXELS[:, ::2], STAMP), image_to_msg(PIXELS[:, ::2], STAMP)),
    'camera': (camera_to_raw(CAMERA, STAMP), camera_to_msg(CAMERA, STAMP)),
    'odometry': (
        odometry_to_raw(ODOMETRY, STAMP, frame_id='odom'),
        odometry_to_msg(ODOMETRY, STAMP, frame_id='odom'),
    ),
    'truth': (
        odometry_to_raw(ODOMETRY, STAMP, frame_id='map'),
        odometry_to_msg(ODOMETRY, STAMP, frame_id='map'),
    ),
    'head': (head_to_raw(HEAD, STAMP), head_to_msg(HEAD, STAMP)),
    'bumpers': (
        bumpers_to_raw(PRESSED, STAMP, **RADIUS),
        bumpers_to_msg(PRESSED, STAMP, **RADIUS),
    ),
    'twist': (twist_to_raw(TWIST, STAMP), twist_to_msg(TWIST, STAMP)),
    'estimate': (estimate_to_raw(ESTIMATE, STAMP), estimate_to_msg(ESTIMATE, STAMP)),
    'state': (state_to_raw(STATE, STAMP), state_to_msg(STATE, STAMP)),
}


@pytest.mark.parametrize('name', PAIRS)
def test_bytes_hold_what_the_message_of_rclpy_holds(name: str) -> None:
    raw, message = PAIRS[name]
    made_by_rclpy = serialize_message(message)
    assert deserialize_message(raw, type(message)) == deserialize_message(
        made_by_rclpy, type(message)
    )
    used = len(raw)
    different = [i for i in range(used) if raw[i] != made_by_rclpy[i]]
    assert not any(raw[i] for i in different), 'only what nobody reads differs, and it is zero'


def _keep(heard: list[tuple[int, bytes]], stamp_ns: int, raw: bytes) -> None:
    heard.append((stamp_ns, raw))


def test_bytes_are_as_many_as_rclpy_sends() -> None:
    rclpy.init(args=[], domain_id=fresh_domain())
    node = rclpy.create_node('listener')
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    try:
        for name, (raw, message) in PAIRS.items():
            heard: list[tuple[int, bytes]] = []
            hear = partial(_keep, heard)
            publisher = node.create_publisher(type(message), name, RELIABLE_QOS)
            subscribe_raw(node, type(message), name, hear, RELIABLE_QOS)
            while not publisher.get_subscription_count():
                executor.spin_once(timeout_sec=0.1)
            publisher.publish(message)
            publisher.publish(raw)
            while len(heard) < 2:
                executor.spin_once(timeout_sec=0.1)
            assert [stamp_ns for stamp_ns, _ in heard] == [STAMP, STAMP], name
            assert len(heard[0][1]) == len(heard[1][1]), name
            assert heard[1][1] == raw, name
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def test_landmarks_not_seen_are_nan() -> None:
    raw = landmarks_to_raw([None, SEEN, None], STAMP)
    points = deserialize_message(raw, PolygonStamped).polygon.points
    expected = landmarks_to_msg([None, SEEN, None], STAMP)
    assert str(points) == str(expected.polygon.points)


def own_and_foreign(own: bytes, message: object) -> list[bytes]:
    """Return a message as it is sent here, and as one who names other frames sends it."""
    foreign: Any = copy.deepcopy(message)
    foreign.header.frame_id = 'somewhere/else'
    return [own, serialize_message(foreign)]


@given(POSES, METRES, METRES)
def test_odometry(pose: Pose2, linear: float, steering: float) -> None:
    odometry = Odometry(
        pose=pose, twist=Twist2(linear_m_per_s=linear, steering_rad_per_s=steering)
    )
    foreign = odometry_to_msg(odometry, STAMP, frame_id='odom', covariance=np.ones(36))
    for raw in own_and_foreign(odometry_to_raw(odometry, STAMP, frame_id='odom'), foreign):
        back = odometry_from_raw(raw)
        assert back.twist == odometry.twist
        assert (back.pose.x_m, back.pose.y_m) == (pose.x_m, pose.y_m)
        assert back.pose.heading_rad == pytest.approx(pose.heading_rad, abs=1e-12)


@given(POSES)
def test_estimate(pose: Pose2) -> None:
    estimate = PoseEstimate(pose=pose, covariance=COVARIANCE)
    for raw in own_and_foreign(estimate_to_raw(estimate, STAMP), estimate_to_msg(estimate, STAMP)):
        back = estimate_from_raw(raw)
        assert (back.covariance == COVARIANCE).all()
        assert back.pose.heading_rad == pytest.approx(pose.heading_rad, abs=1e-12)


@given(STATES)
def test_state_survives_to_the_last_digit(state: RegionState) -> None:
    own = state_to_raw(state, STAMP)
    assert deserialize_message(own, DiagnosticArray) == state_to_msg(state, STAMP)
    for raw in own_and_foreign(own, state_to_msg(state, STAMP)):
        assert state_from_raw(raw) == state


def test_what_others_send_in_another_order_is_read_too() -> None:
    message = state_to_msg(STATE, STAMP)
    message.status[0].values = message.status[0].values[::-1]
    assert state_from_raw(serialize_message(message)) == STATE
    joints = head_to_msg(HEAD, STAMP)
    joints.name, joints.position = joints.name[::-1], joints.position[::-1]
    assert head_from_raw(serialize_message(joints)) == HEAD
    image = image_to_msg(PIXELS, STAMP)
    image.width = 3
    assert image_from_raw(serialize_message(image)).tolist() == PIXELS[:, :3].tolist()


def test_the_rest_is_read() -> None:
    for raw in own_and_foreign(*PAIRS['head']):
        assert head_from_raw(raw) == HEAD
    for raw in own_and_foreign(*PAIRS['twist']):
        assert twist_from_raw(raw) == TWIST
    for raw in own_and_foreign(*PAIRS['bumpers']):
        assert bumpers_from_raw(raw) == PRESSED
    for raw in own_and_foreign(*PAIRS['camera']):
        assert camera_from_raw(raw) == CAMERA
    for raw in own_and_foreign(*PAIRS['image']):
        assert image_from_raw(raw).tolist() == PIXELS.tolist()


READERS: list[Callable[[bytes], object]] = [
    odometry_from_raw,
    head_from_raw,
    twist_from_raw,
    bumpers_from_raw,
    camera_from_raw,
    image_from_raw,
    estimate_from_raw,
    state_from_raw,
]
NAMES = ('odometry', 'head', 'twist', 'bumpers', 'camera', 'image', 'estimate', 'state')
OWN = [PAIRS[name][0] for name in NAMES]


@pytest.mark.parametrize(('reader', 'raw'), list(zip(READERS, OWN, strict=True)))
def test_what_is_cut_off_is_refused(reader: Callable[[bytes], object], raw: bytes) -> None:
    for size in range(0, len(raw) - 8, 7):
        with pytest.raises(MessageError):
            reader(raw[:size])


@pytest.mark.parametrize(
    ('raw', 'reader', 'reason'),
    [
        (
            twist_to_raw(Twist2(linear_m_per_s=math.nan, steering_rad_per_s=0.0), STAMP),
            twist_from_raw,
            r'twist\.linear\.x = nan',
        ),
        (
            head_to_raw(HeadAngles(turret_rad=0.0, pan_rad=math.inf, tilt_rad=0.0), STAMP),
            head_from_raw,
            'pan_joint = inf',
        ),
        (
            estimate_to_raw(PoseEstimate(pose=POSE, covariance=-COVARIANCE), STAMP),
            estimate_from_raw,
            'covariance with diagonal',
        ),
        (
            PAIRS['state'][0].replace(b'0.5\0', b'nan\0'),
            state_from_raw,
            'goal_probability = nan',
        ),
        (
            PAIRS['state'][0].replace(b'FRONT/NEAR', b'FRONT/HERE'),
            state_from_raw,
            'FRONT/HERE',
        ),
    ],
)
def test_what_cannot_be_used_is_refused_by_name(
    raw: bytes, reader: Callable[[bytes], object], reason: str
) -> None:
    with pytest.raises(MessageError, match=reason):
        reader(raw)


def test_a_message_too_short_for_a_stamp_is_told_and_dropped(
    capfd: pytest.CaptureFixture[str],
) -> None:
    rclpy.init(args=[], domain_id=fresh_domain())
    node = rclpy.create_node('listener')
    heard: list[int] = []
    try:
        subscribe_raw(
            node, Clock, 'clock', lambda stamp_ns, _: heard.append(stamp_ns), RELIABLE_QOS
        )
        (subscription,) = node.subscriptions
        subscription.callback(b'\0\1\0\0\0')
        subscription.callback(clock_to_raw(STAMP))
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    assert heard == [STAMP]
    assert 'clock: a message of 5 bytes is dropped' in capfd.readouterr().err
