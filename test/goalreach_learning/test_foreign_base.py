"""The controller with other people's bases, over DDS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
import math
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState, LaserScan

from goalreach_learning.goal_reaching_controller_node import GoalReachingControllerNode
from goalreach_msgs_py.diagnostic_messages import state_to_raw, transition_from_raw
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, stamp_from_msg
from goalreach_msgs_py.sensor_messages import bumpers_to_raw
from goalreach_msgs_py.topics import BUMPERS, CMD_VEL, HEAD_COMMAND, STATE, TRANSITION
from goalreach_msgs_py.values import Confidence, PathOutcome, Pose2, PoseEstimate, RegionState
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig
from graphs import fresh_domain

MS = 1_000_000
FAR = Pose2(x_m=1.778, y_m=4.0, heading_rad=-math.pi / 2)


def state_at(pose: Pose2, *, sure: bool = True) -> RegionState:
    estimate = PoseEstimate(pose=pose, covariance=np.diag([1e-4, 1e-4, 1e-4]))
    state = StateEstimator(StateEstimatorConfig()).estimate(estimate)
    return state if sure else replace(state, confidence=Confidence.UNCERTAIN)


class Base:
    """A robot and the estimate of where it is; what it sends is up to the test."""

    def __init__(self, command: type[Any]) -> None:
        self.node = Node('base', enable_rosout=False)
        self.commands: list[Any] = []
        self.outcomes: list[PathOutcome | None] = []
        self.states = self.node.create_publisher(DiagnosticArray, STATE, 50)
        self.bumpers = self.node.create_publisher(LaserScan, BUMPERS, 50)
        self.node.create_subscription(command, CMD_VEL, self.commands.append, 50)
        self.node.create_subscription(
            DiagnosticArray, TRANSITION, self._on_transition, 50, raw=True
        )
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)

    def _on_transition(self, raw: bytes) -> None:
        self.outcomes.append(transition_from_raw(raw).outcome)

    def send_state(self, stamp_ns: int, *, sure: bool = True) -> None:
        self.states.publish(state_to_raw(state_at(FAR, sure=sure), stamp_ns))

    def send_bumpers(self, stamp_ns: int, pressed: list[bool]) -> None:
        raw = bumpers_to_raw([False] * 20, stamp_ns, body_radius_m=0.2, scan_time_s=0.02)
        message = deserialize_message(raw, LaserScan)
        message.ranges = [0.2 if on else math.inf for on in pressed]
        self.bumpers.publish(bytes(serialize_message(message)))

    def spin(self, condition: Callable[[], bool], limit_s: float = 5.0) -> bool:
        deadline_s = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > deadline_s:
                return False
            self.executor.spin_once(timeout_sec=0.01)
        return True


@contextmanager
def driving(command: type[Any] = TwistStamped, **parameters: object) -> Iterator[Base]:
    words = [w for name, value in parameters.items() for w in ('-p', f'{name}:={value}')]
    rclpy.init(args=['--ros-args', '-p', 'policy:=paper', *words], domain_id=fresh_domain())
    base, controller = Base(command), GoalReachingControllerNode()
    base.executor.add_node(controller)
    try:
        assert base.spin(
            lambda: (
                base.states.get_subscription_count() > 0
                and base.bumpers.get_subscription_count() > 0
                and base.node.count_publishers(TRANSITION) > 0
                and base.node.count_publishers(CMD_VEL) > 0
            )
        )
        yield base
    finally:
        base.executor.shutdown()
        for node in (controller, base.node):
            node.destroy_node()
        rclpy.try_shutdown()


@pytest.mark.parametrize(('rays', 'beside_ns'), [(20, 0), (6, 5 * MS), (1, -5 * MS)])
def test_bumpers_of_any_number_and_clock(rays: int, beside_ns: int) -> None:
    with driving() as base:
        for tick in range(1, 11):
            stamp = 40 * MS * tick
            pressed = [tick == 10 and ray == rays - 1 for ray in range(rays)]
            for odd in (0, 20 * MS):  # twice as often as images
                base.send_bumpers(stamp + beside_ns + odd, pressed)
            base.send_state(stamp)
            assert base.spin(lambda: len(base.commands) >= tick)  # noqa: B023
        assert base.spin(lambda: base.outcomes == [PathOutcome.BUMP])
    assert [stamp_from_msg(c.header.stamp) // MS for c in base.commands] == [*range(40, 401, 40)]
    assert base.commands[8].twist.linear.x > 0.3


def test_a_base_without_bumpers_that_takes_a_twist() -> None:
    with driving(Twist, bumpers='optional', stamped_cmd_vel=False) as base:
        for tick in range(1, 6):
            base.send_state(40 * MS * tick)
        assert base.spin(lambda: len(base.commands) >= 5)
    assert base.commands[-1].linear.x > 0.3


def test_optional_bumpers_that_are_pressed_end_a_path() -> None:
    with driving(bumpers='optional') as base:
        base.send_state(40 * MS)
        base.send_state(80 * MS)
        assert base.spin(lambda: len(base.commands) >= 2)
        base.send_bumpers(90 * MS, [False, True])
        base.send_state(120 * MS)
        base.send_state(160 * MS)
        assert base.spin(lambda: PathOutcome.BUMP in base.outcomes)


def test_required_bumpers_that_fall_silent_stop_the_commands() -> None:
    with driving() as base:
        for tick in range(1, 20):
            if tick < 5:
                base.send_bumpers(40 * MS * tick, [False] * 20)
            base.send_state(40 * MS * tick)
            base.spin(lambda: len(base.commands) >= tick, 0.05)  # noqa: B023
    stamps = [stamp_from_msg(command.header.stamp) // MS for command in base.commands]
    assert stamps[:4] == [40, 80, 120, 160]
    assert max(stamps) <= 260


@pytest.mark.parametrize('has_head', [False, True])
def test_a_robot_without_a_head_looks_around(has_head: bool) -> None:  # noqa: FBT001
    with driving(bumpers='optional') as base:
        if has_head:
            base.node.create_publisher(JointState, HEAD_COMMAND, RELIABLE_QOS)
            assert base.spin(lambda: base.node.count_publishers(HEAD_COMMAND) > 0)
        base.send_state(40 * MS)
        for tick in range(2, 40):
            base.send_state(40 * MS * tick, sure=False)
            assert base.spin(lambda: len(base.commands) >= tick)  # noqa: B023
    turning = [command.twist.angular.z for command in base.commands]
    assert turning[:26] == [0.0] * 26  # a second
    assert turning[30:] == [0.0 if has_head else pytest.approx(math.radians(30.0))] * 9
    assert all(command.twist.linear.x == 0.0 for command in base.commands)
