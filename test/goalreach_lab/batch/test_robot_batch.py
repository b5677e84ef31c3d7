import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_lab.batch.robot_batch import RobotBatch
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import FloatArray, Pose2, Twist2
from goalreach_sim.robot import Robot, Walls
from goalreach_sim.simulator_config import DriveConfig

WALLS = Walls(width_m=2.0, length_m=3.0, body_radius_m=0.25)
CONFIG = DriveConfig()
WATCHDOG_S = 0.7


def make_pair(count: int, seed: int) -> tuple[RobotBatch, list[Robot], np.random.Generator]:
    """Return a batch and as many single robots at the same random poses, some at walls."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0.25, 1.75, count), rng.uniform(0.25, 2.75, count)
    x[rng.random(count) < 0.2] = 0.25
    y[rng.random(count) < 0.2] = 2.75
    heading = rng.uniform(-7.0, 7.0, count)
    heading[rng.random(count) < 0.3] = math.pi / 2
    batch = RobotBatch(CONFIG, WALLS, count, watchdog_s=WATCHDOG_S)
    batch.place(x, y, heading)
    singles = [Robot(CONFIG, WALLS, watchdog_s=WATCHDOG_S) for _ in range(count)]
    for robot, pose in zip(singles, batch.poses.T.tolist(), strict=True):
        robot.place(Pose2(x_m=pose[0], y_m=pose[1], heading_rad=pose[2]))
    return batch, singles, rng


def drive_both(
    batch: RobotBatch, singles: list[Robot], linear: FloatArray, steering: FloatArray
) -> None:
    batch.drive(linear, steering)
    for robot, v, w in zip(singles, linear.tolist(), steering.tolist(), strict=True):
        robot.drive(Twist2(linear_m_per_s=v, steering_rad_per_s=w))


def assert_equal(batch: RobotBatch, singles: list[Robot]) -> None:
    poses = np.array([[r.x_m, r.y_m, r.heading_rad] for r in singles]).T
    np.testing.assert_allclose(batch.poses, poses, rtol=0.0, atol=1e-9)
    velocities = np.array([[r.translation.velocity, r.steering.velocity] for r in singles]).T
    np.testing.assert_allclose(batch.velocities, velocities, rtol=0.0, atol=1e-9)


@given(
    seed=st.integers(0, 2**31),
    steps=st.lists(st.floats(0.001, 2.5), min_size=1, max_size=8),
)
@settings(max_examples=25, deadline=None)
def test_each_robot_moves_as_one_alone(seed: int, steps: list[float]) -> None:
    batch, singles, rng = make_pair(12, seed)
    for dt_s in steps:
        if rng.random() < 0.7:
            straight = rng.random(12) < 0.4
            steering = np.where(straight, 0.0, rng.uniform(-1.5, 1.5, 12))
            drive_both(batch, singles, rng.uniform(-0.7, 0.7, 12), steering)
        batch.advance(dt_s)
        for robot in singles:
            robot.advance(dt_s)
        assert_equal(batch, singles)


def test_long_drives_at_the_camera_s_step_find_walls_and_stay_equal() -> None:
    batch, singles, rng = make_pair(60, 4)
    touched = np.zeros(60, dtype=np.bool_)
    for step in range(250):
        if step % 20 == 0:
            drive_both(
                batch, singles, rng.uniform(-0.6, 0.6, 60), rng.uniform(-1.1, 1.1, 60).round(1)
            )
        batch.advance(0.04)
        for robot in singles:
            robot.advance(0.04)
        touched |= [any(robot.bumpers) for robot in singles]
    assert_equal(batch, singles)
    assert touched.mean() > 0.3


def test_one_command_for_all() -> None:
    batch = RobotBatch(CONFIG, WALLS, 3, watchdog_s=10.0)
    batch.place([0.5, 0.6, 0.7], 1.0, math.pi / 2)
    batch.drive(0.1, 0.0)
    batch.advance(2.0)
    x, y, heading = batch.poses
    assert x == pytest.approx([0.5, 0.6, 0.7])
    # 0.1 m/s after a ramp at 30 in/s^2: 2 * 0.1 - 0.1^2 / (2 * 0.762) m.
    assert y == pytest.approx(1.0 + 0.2 - 0.01 / 1.524)
    assert heading == pytest.approx(math.pi / 2)


def test_placing_again_starts_anew() -> None:
    batch, _, _ = make_pair(5, 1)
    batch.drive(0.5, 1.0)
    batch.advance(3.0)
    batch.place(1.0, 1.5, 0.3)
    batch.advance(1.0)
    assert batch.poses.T.tolist() == [[1.0, 1.5, 0.3]] * 5
    assert not batch.velocities.any()


@pytest.mark.parametrize('pose', [(0.2, 1.0, 0.0), (1.0, math.nan, 0.0), (1.0, 1.0, math.inf)])
def test_refuses_a_pose_in_a_wall(pose: tuple[float, float, float]) -> None:
    batch = RobotBatch(CONFIG, WALLS, 2, watchdog_s=1.0)
    with pytest.raises(ConfigurationError, match='robot 1'):
        batch.place([1.0, pose[0]], [1.0, pose[1]], [0.0, pose[2]])


def test_refuses_a_command_that_is_no_number() -> None:
    batch = RobotBatch(CONFIG, WALLS, 2, watchdog_s=1.0)
    with pytest.raises(ValueError, match='not finite'):
        batch.drive([0.1, math.nan], 0.0)
