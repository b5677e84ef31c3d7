"""Poses and velocities to messages and back, and messages that cannot be used."""

from collections.abc import Callable
from dataclasses import replace
import math

from geometry_msgs.msg import PoseWithCovarianceStamped, TwistStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry as OdometryMsg
from nav_msgs.msg import Path
import numpy as np
import pytest

from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.pose_messages import (
    estimate_from_raw,
    estimate_to_raw,
    odometry_from_raw,
    odometry_to_raw,
    path_to_raw,
    twist_from_raw,
    twist_to_raw,
)
from goalreach_msgs_py.ros.messaging import stamp_from_msg
from goalreach_msgs_py.values import Odometry, Pose2, PoseEstimate, Twist2
from ros_objects import as_object, by_others, changed

STAMP = 1_234_567_890_123
METRES = st.floats(-100.0, 100.0)
POSES = st.builds(Pose2, x_m=METRES, y_m=METRES, heading_rad=st.floats(-3.14, 3.14))
TWISTS = st.builds(Twist2, linear_m_per_s=METRES, steering_rad_per_s=METRES)
POSE = Pose2(x_m=1.5, y_m=-2.5, heading_rad=0.75)
TWIST = Twist2(linear_m_per_s=0.25, steering_rad_per_s=-0.5)
COVARIANCE = np.array([[3.0, 0.1, 0.2], [0.1, 2.0, 0.3], [0.2, 0.3, 1.0]])
ESTIMATE = PoseEstimate(pose=POSE, covariance=COVARIANCE)
ODOMETRY = odometry_to_raw(Odometry(pose=POSE, twist=TWIST), STAMP, frame_id='odom')


def check_pose(back: Pose2, pose: Pose2) -> None:
    assert (back.x_m, back.y_m) == (pose.x_m, pose.y_m)
    assert back.heading_rad == pytest.approx(pose.heading_rad, abs=1e-12)


@settings(deadline=None)  # the first message of a type generates its codecs
@given(POSES, TWISTS)
def test_odometry(pose: Pose2, twist: Twist2) -> None:
    odometry = Odometry(pose=pose, twist=twist)
    raw = odometry_to_raw(odometry, STAMP, frame_id='odom')
    for each in by_others(raw, OdometryMsg):
        back = odometry_from_raw(each)
        assert back.twist == twist
        check_pose(back.pose, pose)


def test_odometry_as_others_see_it() -> None:
    message = as_object(ODOMETRY, OdometryMsg)
    assert (message.header.frame_id, message.child_frame_id) == ('odom', 'base_link')
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1234, 567890123)
    assert (message.pose.pose.position.x, message.pose.pose.position.y) == (1.5, -2.5)
    assert (message.twist.twist.linear.x, message.twist.twist.angular.z) == (0.25, -0.5)
    assert not any(message.pose.covariance)
    assert not any(message.twist.covariance)


def test_pose_facing_the_goal_wall_has_the_known_quaternion() -> None:
    pose = Pose2(x_m=0.0, y_m=0.0, heading_rad=-math.pi / 2)
    raw = estimate_to_raw(replace(ESTIMATE, pose=pose), STAMP)
    orientation = as_object(raw, PoseWithCovarianceStamped).pose.pose.orientation
    assert orientation.z == pytest.approx(-math.sqrt(0.5))
    assert orientation.w == pytest.approx(math.sqrt(0.5))


def with_pose(**fields: float) -> bytes:
    message = as_object(estimate_to_raw(ESTIMATE, STAMP), PoseWithCovarianceStamped)
    for name, value in fields.items():
        part, _, field = name.partition('_')
        setattr(getattr(message.pose.pose, part), field, value)
    return changed(estimate_to_raw(ESTIMATE, STAMP), PoseWithCovarianceStamped, pose=message.pose)


def test_pose_without_a_rotation_is_refused() -> None:
    with pytest.raises(MessageError, match='orientation'):
        estimate_from_raw(with_pose(orientation_z=0.0, orientation_w=0.0))


def test_pose_that_is_not_finite_is_refused() -> None:
    with pytest.raises(MessageError, match=r'pose = \(inf'):
        estimate_from_raw(with_pose(position_x=math.inf))


def test_quaternion_of_any_length_is_a_rotation() -> None:
    raw = with_pose(orientation_z=1e300 * math.sin(0.2), orientation_w=1e300 * math.cos(0.2))
    assert estimate_from_raw(raw).pose.heading_rad == pytest.approx(0.4)


@settings(deadline=None)  # the first message of a type generates its codecs
@given(TWISTS)
def test_twist(twist: Twist2) -> None:
    raw = twist_to_raw(twist, STAMP)
    assert stamp_of(raw) == STAMP
    assert as_object(raw, TwistStamped).header.frame_id == 'base_link'
    for each in by_others(raw, TwistStamped):
        assert twist_from_raw(each) == twist


def test_twist_that_is_not_a_number_is_refused() -> None:
    with pytest.raises(MessageError, match=r'twist\.linear\.x = nan'):
        twist_from_raw(twist_to_raw(replace(TWIST, linear_m_per_s=math.nan), STAMP))


@settings(deadline=None)  # the first message of a type generates its codecs
@given(POSES)
def test_estimate(pose: Pose2) -> None:
    raw = estimate_to_raw(PoseEstimate(pose=pose, covariance=COVARIANCE), STAMP)
    for each in by_others(raw, PoseWithCovarianceStamped):
        back = estimate_from_raw(each)
        assert (back.covariance == COVARIANCE).all()
        check_pose(back.pose, pose)


def test_covariance_stands_where_others_look_for_it() -> None:
    message = as_object(estimate_to_raw(ESTIMATE, STAMP), PoseWithCovarianceStamped)
    assert message.header.frame_id == 'map'
    assert (message.pose.covariance[0], message.pose.covariance[35]) == (3.0, 1.0)
    assert (message.pose.covariance[5], message.pose.covariance[11]) == (0.2, 0.3)


@pytest.mark.parametrize('variance', [math.nan, -1.0])
def test_estimate_without_an_honest_covariance_is_refused(variance: float) -> None:
    covariance = COVARIANCE.copy()
    covariance[0, 0] = variance
    with pytest.raises(MessageError, match='covariance with diagonal'):
        estimate_from_raw(estimate_to_raw(replace(ESTIMATE, covariance=covariance), STAMP))


def test_path_keeps_poses_and_stamps() -> None:
    raw = path_to_raw([(STAMP, POSE), (STAMP + 1, POSE)], STAMP + 2)
    message = as_object(raw, Path)
    assert [each.header.frame_id for each in message.poses] == ['map', 'map']
    assert message.poses[0].pose.position.y == -2.5
    stamps = [stamp_from_msg(each.header.stamp) for each in message.poses]
    assert stamps == [STAMP, STAMP + 1]
    orientation = message.poses[1].pose.orientation
    heading_rad = 2.0 * math.atan2(orientation.z, orientation.w)
    check_pose(replace(POSE, heading_rad=heading_rad), POSE)


@pytest.mark.parametrize(
    ('reader', 'raw'),
    [
        (odometry_from_raw, ODOMETRY),
        (twist_from_raw, twist_to_raw(TWIST, STAMP)),
        (estimate_from_raw, estimate_to_raw(ESTIMATE, STAMP)),
    ],
)
def test_what_is_cut_off_is_refused(reader: Callable[[bytes], object], raw: bytes) -> None:
    for size in range(0, len(raw) - 7, 7):
        with pytest.raises(MessageError):
            reader(raw[:size])
