"""What is observed of a stack, on sequences worked out by hand."""

from dataclasses import replace

import pytest

from goalreach_lab.faults.observer import StackObserver
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.values import Confidence, Odometry, Pose2, RegionState, Twist2

TICK_NS = 40_000_000


def truth(y_m: float) -> Odometry:
    pose = Pose2(x_m=1.5, y_m=y_m, heading_rad=0.0)
    return Odometry(pose=pose, twist=Twist2(linear_m_per_s=0.5, steering_rad_per_s=0.0))


def state(y_m: float, confidence: Confidence = Confidence.OK) -> RegionState:
    return RegionState(
        region=(1, 1),
        mu_x=(0.0, 1.0, 0.0),
        mu_y=(0.0, 1.0, 0.0),
        pose=Pose2(x_m=1.5, y_m=y_m, heading_rad=0.0),
        goal_probability=0.0,
        confidence=confidence,
    )


def drive(observer: StackObserver, first: int, count: int, *, error_m: float = 0.0) -> None:
    """Let ticks pass in which all is as it should be, but for the error of the pose."""
    for tick in range(first, first + count):
        observer.on_truth(tick * TICK_NS, truth(2.0), wall_s=0.04 * tick)
        observer.on_state(tick * TICK_NS, state(2.0 + error_m))
        observer.on_command(tick * TICK_NS, Twist2(linear_m_per_s=0.5, steering_rad_per_s=0.0))


def test_sound_driving_is_seen_from_its_first_tick() -> None:
    observer = StackObserver(Arena())
    drive(observer, 1, 9)
    assert observer.normal_since is None
    drive(observer, 10, 5)
    assert observer.normal_since == (2 * TICK_NS, 0.08)  # the first tick had no command before it


def test_a_chain_that_has_broken_is_not_sound() -> None:
    observer = StackObserver(Arena())
    drive(observer, 1, 20)
    observer.await_normal()
    for tick in range(21, 60):
        observer.on_truth(tick * TICK_NS, truth(2.0), wall_s=0.04 * tick)
    assert observer.normal_since is None


def test_a_pose_is_wrong_beyond_six_inches_and_only_where_it_is_believed() -> None:
    observer = StackObserver(Arena())
    observer.on_truth(TICK_NS, truth(2.0), wall_s=0.04)
    observer.on_state(TICK_NS, state(2.15))
    assert observer.overconfident == 0
    assert observer.worst_m == pytest.approx(0.15)
    observer.on_state(TICK_NS, state(2.16, Confidence.UNCERTAIN))
    assert observer.overconfident == 0
    observer.on_state(TICK_NS, state(2.16))
    assert observer.overconfident == 1


def test_a_wall_that_is_touched_once_is_one_bump() -> None:
    observer = StackObserver(Arena())
    for tick, y_m in enumerate([0.3, 0.225, 0.225, 0.3, 0.225], start=1):
        observer.on_truth(tick * TICK_NS, truth(y_m), wall_s=0.04 * tick)
    assert observer.bumps == 2


def test_an_obstacle_that_is_touched_is_a_bump_too() -> None:
    post = Obstacle(x_m=1.5, y_m=2.0, radius_m=0.2)
    observer = StackObserver(replace(Arena(), obstacles=(post,), starts=()))
    for tick, y_m in enumerate([2.6, 2.42, 2.6], start=1):
        observer.on_truth(tick * TICK_NS, truth(y_m), wall_s=0.04 * tick)
    assert observer.bumps == 1


def test_the_clock_at_a_moment_is_the_tick_sent_last_even_of_a_stack_that_began_anew() -> None:
    observer = StackObserver(Arena())
    observer.sent_ns.update({40: 1000, 80: 1100, 120: 1200})
    assert [observer.clock_at(wall_ns) for wall_ns in (999, 1000, 1150, 5000)] == [0, 40, 80, 120]
    observer.sent_ns.update({40: 2000, 80: 2100})
    assert [observer.clock_at(wall_ns) for wall_ns in (1999, 2050, 2100)] == [120, 40, 80]


def test_a_state_from_the_future_is_compared_with_the_newest_truth() -> None:
    observer = StackObserver(Arena())
    observer.on_truth(TICK_NS, truth(2.0), wall_s=0.04)
    observer.on_state(TICK_NS + 5_000_000_000, state(2.5))
    assert observer.overconfident == 1
    assert observer.worst_m == pytest.approx(0.5)
