"""Values to messages and back, and messages that cannot be used."""

import math
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped, TwistStamped
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, JointState, LaserScan

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.ros.common_messages import (
    MessageError,
    pose_from_msg,
    pose_to_msg,
    stamp_from_msg,
    stamp_to_msg,
    twist_from_msg,
    twist_to_msg,
)
from goalreach_msgs_py.ros.estimate_messages import (
    estimate_from_msg,
    estimate_to_msg,
    landmarks_from_msg,
    landmarks_to_msg,
    state_from_msg,
    state_to_msg,
)
from goalreach_msgs_py.ros.learning_messages import (
    path_to_msg,
    q_table_from_msg,
    q_table_to_msg,
    transition_from_msg,
    transition_to_msg,
)
from goalreach_msgs_py.ros.sensor_messages import (
    bumpers_from_msg,
    bumpers_to_msg,
    camera_from_msg,
    camera_to_msg,
    head_from_msg,
    head_to_msg,
    image_from_msg,
    image_to_msg,
    odometry_from_msg,
    odometry_to_msg,
)
from goalreach_msgs_py.values import (
    Confidence,
    HeadAngles,
    LandmarkObservation,
    Odometry,
    PathOutcome,
    Pose2,
    PoseEstimate,
    RegionState,
    Transition,
    Twist2,
)

STAMP = 1_234_567_890_123
METRES = st.floats(-100.0, 100.0)
HEADINGS = st.floats(-3.14, 3.14)
POSES = st.builds(Pose2, x_m=METRES, y_m=METRES, heading_rad=HEADINGS)
MEMBERSHIPS = st.tuples(*[st.floats(0.0, 1.0)] * 3)


def test_stamp() -> None:
    assert (stamp_to_msg(STAMP).sec, stamp_to_msg(STAMP).nanosec) == (1234, 567890123)
    assert stamp_from_msg(stamp_to_msg(STAMP)) == STAMP


@given(POSES)
def test_pose(pose: Pose2) -> None:
    back = pose_from_msg(pose_to_msg(pose))
    assert (back.x_m, back.y_m) == (pose.x_m, pose.y_m)
    assert back.heading_rad == pytest.approx(pose.heading_rad, abs=1e-12)


def test_pose_facing_the_goal_wall_has_the_known_quaternion() -> None:
    message = pose_to_msg(Pose2(x_m=0.0, y_m=0.0, heading_rad=-math.pi / 2))
    assert message.orientation.z == pytest.approx(-math.sqrt(0.5))
    assert message.orientation.w == pytest.approx(math.sqrt(0.5))


def test_pose_without_a_rotation_is_refused() -> None:
    message = pose_to_msg(Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0))
    message.orientation.w = 0.0
    with pytest.raises(MessageError, match='orientation'):
        pose_from_msg(message)


@given(METRES, METRES)
def test_twist(linear: float, steering: float) -> None:
    twist = Twist2(linear_m_per_s=linear, steering_rad_per_s=steering)
    message = twist_to_msg(twist, STAMP)
    assert twist_from_msg(message) == twist
    assert stamp_from_msg(message.header.stamp) == STAMP


def test_twist_that_is_not_a_number_is_refused() -> None:
    message = TwistStamped()
    message.twist.linear.x = math.nan
    with pytest.raises(MessageError, match=r'twist\.linear\.x = nan'):
        twist_from_msg(message)


def test_image() -> None:
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    message = image_to_msg(image, STAMP)
    assert (message.width, message.height, message.step, message.encoding) == (4, 3, 4, 'mono8')
    assert (image_from_msg(message) == image).all()


def test_image_of_every_second_column() -> None:
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)[:, ::2]
    assert (image_from_msg(image_to_msg(image, STAMP)) == image).all()


def test_image_with_padding() -> None:
    message = image_to_msg(np.arange(12, dtype=np.uint8).reshape(3, 4), STAMP)
    message.width = 3
    assert image_from_msg(message).tolist() == [[0, 1, 2], [4, 5, 6], [8, 9, 10]]


@pytest.mark.parametrize(
    'change', [{'encoding': 'rgb8'}, {'width': 5}, {'height': 2}, {'step': 3}, {'width': 0}]
)
def test_image_that_does_not_fit_is_refused(change: dict[str, Any]) -> None:
    message = image_to_msg(np.zeros((3, 4), dtype=np.uint8), STAMP)
    for name, value in change.items():
        setattr(message, name, value)
    with pytest.raises(MessageError):
        image_from_msg(message)


def test_camera() -> None:
    camera = PinholeCamera(
        width_px=320,
        height_px=200,
        fx_px=500.0,
        fy_px=510.0,
        cx_px=160.0,
        cy_px=100.0,
        distortion=(0.1, 0.2, 0.3, 0.4, 0.5),
    )
    message = camera_to_msg(camera, STAMP)
    assert message.k.tolist() == [500, 0, 160, 0, 510, 100, 0, 0, 1]
    assert camera_from_msg(message) == camera


@pytest.mark.parametrize('k0', [0.0, -1.0, math.nan])
def test_camera_without_focal_length_is_refused(k0: float) -> None:
    message = CameraInfo(width=640, height=480, k=[k0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    with pytest.raises(MessageError, match='fx_px'):
        camera_from_msg(message)


@given(POSES, METRES, METRES)
def test_odometry(pose: Pose2, linear: float, steering: float) -> None:
    twist = Twist2(linear_m_per_s=linear, steering_rad_per_s=steering)
    message = odometry_to_msg(Odometry(pose=pose, twist=twist), STAMP, frame_id='odom')
    back = odometry_from_msg(message)
    assert back.twist == twist
    assert back.pose.heading_rad == pytest.approx(pose.heading_rad, abs=1e-12)
    assert (message.header.frame_id, message.child_frame_id) == ('odom', 'base_link')


def test_head_is_found_by_joint_name() -> None:
    head = HeadAngles(turret_rad=1.0, pan_rad=2.0, tilt_rad=3.0)
    message = head_to_msg(head, STAMP)
    assert list(message.name) == ['turret_joint', 'pan_joint', 'tilt_joint']
    shuffled = JointState(
        name=['wheel', 'tilt_joint', 'turret_joint', 'pan_joint'], position=[9.0, 3.0, 1.0, 2.0]
    )
    assert head_from_msg(message) == head_from_msg(shuffled) == head


@pytest.mark.parametrize(
    'message',
    [
        JointState(name=['pan_joint', 'tilt_joint'], position=[0.0, 0.0]),
        JointState(
            name=['turret_joint', 'pan_joint', 'tilt_joint'], position=[0.0, math.nan, 0.0]
        ),
        JointState(name=['turret_joint', 'pan_joint', 'tilt_joint'], position=[0.0]),
    ],
)
def test_head_without_all_joints_is_refused(message: JointState) -> None:
    with pytest.raises(MessageError):
        head_from_msg(message)


def test_bumpers_are_ranges_at_the_body_radius() -> None:
    pressed = [index in (0, 19) for index in range(20)]
    message = bumpers_to_msg(pressed, STAMP, body_radius_m=0.225, scan_time_s=0.04)
    assert message.angle_increment == pytest.approx(math.radians(18))
    assert message.ranges[0] == pytest.approx(0.225)
    assert message.ranges[1] == math.inf
    assert bumpers_from_msg(message) == tuple(pressed)


@pytest.mark.parametrize('ranges', [[], [1.0] * 19, [math.nan] * 20])
def test_bumpers_of_another_kind_are_refused(ranges: list[float]) -> None:
    with pytest.raises(MessageError, match='ranges'):
        bumpers_from_msg(LaserScan(ranges=ranges))


@given(POSES)
def test_estimate(pose: Pose2) -> None:
    covariance = np.array([[3.0, 0.1, 0.2], [0.1, 2.0, 0.3], [0.2, 0.3, 1.0]])
    message = estimate_to_msg(PoseEstimate(pose=pose, covariance=covariance), STAMP)
    assert message.header.frame_id == 'map'
    assert (message.pose.covariance[0], message.pose.covariance[35]) == (3.0, 1.0)
    assert (message.pose.covariance[5], message.pose.covariance[11]) == (0.2, 0.3)
    assert (estimate_from_msg(message).covariance == covariance).all()


@pytest.mark.parametrize('variance', [math.nan, -1.0])
def test_estimate_without_an_honest_covariance_is_refused(variance: float) -> None:
    message = PoseWithCovarianceStamped()
    message.pose.pose.orientation.w = 1.0
    message.pose.covariance[0] = variance
    with pytest.raises(MessageError, match='covariance'):
        estimate_from_msg(message)


def test_landmarks_not_seen_are_nan() -> None:
    seen = LandmarkObservation(u_px=1.5, v_px=2.5, peak_dn=200.0)
    message = landmarks_to_msg([None, seen, None], STAMP)
    assert math.isnan(message.polygon.points[0].x)
    assert landmarks_from_msg(message) == (None, seen, None)


@given(
    st.builds(
        RegionState,
        region=st.tuples(st.integers(0, 2), st.integers(0, 2)),
        mu_x=MEMBERSHIPS,
        mu_y=MEMBERSHIPS,
        pose=POSES,
        goal_probability=st.floats(0.0, 1.0),
        confidence=st.sampled_from(Confidence),
    )
)
def test_state_survives_to_the_last_digit(state: RegionState) -> None:
    assert state_from_msg(state_to_msg(state, STAMP)) == state


def test_state_speaks_the_names_of_the_paper() -> None:
    state = RegionState(
        region=(1, 0),
        mu_x=(0.1, 0.9, 0.0),
        mu_y=(1.0, 0.0, 0.0),
        pose=Pose2(x_m=1.0, y_m=0.5, heading_rad=0.0),
        goal_probability=0.5,
        confidence=Confidence.UNCERTAIN,
    )
    status = state_to_msg(state, STAMP).status[0]
    assert (status.name, status.message, status.level) == ('region_state', 'FRONT/NEAR', b'\x01')
    assert {pair.key: pair.value for pair in status.values}['mu_x.LEFT-SIDE'] == '0.1'


@pytest.mark.parametrize(('key', 'value'), [('mu_x.FRONT', 'x'), ('x_m', 'nan'), ('y_m', None)])
def test_state_with_a_bad_value_is_refused_by_name(key: str, value: str | None) -> None:
    state = RegionState(
        region=(1, 0),
        mu_x=(0.0, 1.0, 0.0),
        mu_y=(1.0, 0.0, 0.0),
        pose=Pose2(x_m=1.0, y_m=0.5, heading_rad=0.0),
        goal_probability=0.5,
        confidence=Confidence.OK,
    )
    message = state_to_msg(state, STAMP)
    status = message.status[0]
    if value is None:
        status.values = [pair for pair in status.values if pair.key != key]
    else:
        next(pair for pair in status.values if pair.key == key).value = value
    with pytest.raises(MessageError, match=key):
        state_from_msg(message)


@pytest.mark.parametrize('outcome', [None, *PathOutcome])
def test_transition(outcome: PathOutcome | None) -> None:
    transition = Transition(
        state=(0, 1),
        action=7,
        reward=-1.0,
        next_state=(1, 1),
        temperature=0.25,
        trial=3,
        path=70,
        outcome=outcome,
    )
    assert transition_from_msg(transition_to_msg(transition, STAMP)) == transition


def test_q_table_is_labelled() -> None:
    q = np.arange(72, dtype=np.float64).reshape(3, 3, 8)
    message = q_table_to_msg(q)
    layout = [(d.label, d.size, d.stride) for d in message.layout.dim]
    assert layout == [('x', 3, 72), ('y', 3, 24), ('action', 8, 8)]
    assert (q_table_from_msg(message) == q).all()


def test_q_table_of_another_shape_is_refused() -> None:
    message = q_table_to_msg(np.zeros((3, 3, 8)))
    message.data = message.data[:-1]
    with pytest.raises(MessageError, match='layout'):
        q_table_from_msg(message)


def test_path_keeps_poses_and_stamps() -> None:
    pose = Pose2(x_m=1.0, y_m=2.0, heading_rad=0.5)
    message = path_to_msg([(STAMP, pose)], STAMP + 1)
    assert stamp_from_msg(message.poses[0].header.stamp) == STAMP
    assert message.poses[0].pose.position.y == 2.0
