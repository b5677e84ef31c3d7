import math

import numpy as np
import pytest

from goalreach_dashboard.pose_history import PoseHistory, Trail
from goalreach_msgs_py.values import Pose2, PoseEstimate

TICK_NS = 40_000_000


def pose(x_m: float, y_m: float, heading_rad: float = 0.0) -> Pose2:
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)


def test_a_trail_is_in_centimetres_from_the_far_wall() -> None:
    trail = Trail(5.0)
    trail.add(1.0, 4.0)
    trail.add(1.01, 4.0)
    trail.add(1.0, 3.5)
    assert trail.text == '100.0,100.0 100.0,150.0 '


def test_a_trail_is_bounded() -> None:
    trail = Trail(5.0)
    for k in range(20_000):
        trail.add(0.03 * k, 1.0)
    assert 1000 < len(trail.text.split()) <= 3000
    assert trail.text.split()[-1] == f'{3.0 * 19_999:.1f},400.0'


def test_errors_compare_one_stamp() -> None:
    poses = PoseHistory(5.0)
    poses.add_truth(TICK_NS, pose(1.0, 1.0))
    poses.add_truth(2 * TICK_NS, pose(1.02, 1.0))
    estimate = PoseEstimate(pose=pose(1.003, 1.004, 0.1), covariance=np.eye(3))
    poses.add_estimate(TICK_NS, estimate, trusted=True)
    assert poses.error == pytest.approx((0.005, 0.1))
    assert poses.compared == pose(1.0, 1.0)


@pytest.mark.parametrize('later', [(2 * TICK_NS, 3.0), (TICK_NS // 2, 1.0)])
def test_a_jump_or_an_earlier_stamp_begins_a_new_trail(later: tuple[int, float]) -> None:
    poses = PoseHistory(5.0)
    poses.add_truth(TICK_NS, pose(1.0, 1.0))
    stamp_ns, x_m = later
    poses.add_truth(stamp_ns, pose(x_m, 1.0))
    assert len(poses.trail.text.split()) == 1
    assert TICK_NS not in poses.truths


def test_an_estimate_of_the_last_path_is_not_on_the_trail_of_this_one() -> None:
    poses = PoseHistory(5.08)
    poses.add_truth(TICK_NS, pose(1.0, 1.0))
    poses.add_truth(2 * TICK_NS, pose(3.0, 4.0))
    late, now = (
        PoseEstimate(pose=pose(*at), covariance=np.eye(3)) for at in ((1.0, 1.0), (3.0, 4.0))
    )
    poses.add_estimate(TICK_NS, late, trusted=True)
    assert poses.estimate_trail.text == ''
    poses.add_estimate(2 * TICK_NS, now, trusted=True)
    assert poses.estimate_trail.text == '300.0,108.0 '


def test_odometry_is_aligned_where_the_path_began() -> None:
    """The encoders start at (0, 0, 0); the robot stood at (1, 2) and looked along +y."""
    poses = PoseHistory(5.0)
    poses.add_truth(0, pose(1.0, 2.0, math.pi / 2))
    poses.add_odometry(0, pose(0.0, 0.0))
    poses.add_odometry(TICK_NS, pose(0.5, 0.0, 0.1))
    assert poses.odometry is not None
    assert poses.odometry.x_m == pytest.approx(1.0)
    assert poses.odometry.y_m == pytest.approx(2.5)
    assert poses.odometry.heading_rad == pytest.approx(math.pi / 2 + 0.1)


def test_a_simulated_day_keeps_the_memory() -> None:
    """25 poses a second would be two million: one in twenty, on a circle that never closes."""
    poses = PoseHistory(5.0)
    for k in range(108_000):
        angle_rad = 0.02 * k
        poses.add_truth(k * TICK_NS, pose(2 + math.cos(angle_rad), 2 + math.sin(angle_rad)))
        poses.add_estimate(
            k * TICK_NS,
            PoseEstimate(pose=pose(2 + math.cos(angle_rad), 2.0), covariance=np.eye(3)),
            trusted=True,
        )
    assert len(poses.trail.text) < 60_000
    assert len(poses.estimate_trail.text) < 60_000
    assert len(poses.truths) <= 256


def test_an_estimate_without_truth_has_no_error() -> None:
    poses = PoseHistory(5.0)
    poses.add_truth(TICK_NS, pose(1.0, 1.0))
    for stamp_ns in (TICK_NS, 2 * TICK_NS):
        estimate = PoseEstimate(pose=pose(1.01, 1.0), covariance=np.eye(3))
        poses.add_estimate(stamp_ns, estimate, trusted=True)
    assert (poses.compared, poses.error) == (None, None)
