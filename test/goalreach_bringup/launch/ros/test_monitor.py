"""The launcher's own node: when it listens, and what it makes of what it hears, over real DDS."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
import math
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry as OdometryMsg
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

from goalreach_bringup.launch.path_evaluator import PathEvaluator, Progress
from goalreach_bringup.launch.ros import monitor as monitor_module
from goalreach_bringup.launch.ros.monitor import RunMonitor
from goalreach_evaluation.path_metrics import PathResult
from goalreach_learning.policy import Policy
from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.diagnostic_messages import (
    q_table_to_raw,
    state_to_raw,
    transition_to_raw,
)
from goalreach_msgs_py.pose_messages import odometry_to_raw
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.ros.messaging import DEEP_QOS
from goalreach_msgs_py.topics import GROUND_TRUTH, MAP_FRAME, STATE, TRANSITION
from goalreach_msgs_py.values import (
    Confidence,
    Odometry,
    PathOutcome,
    Pose2,
    RegionState,
    Transition,
    Twist2,
)
import graphs

START = Pose2(x_m=1.7, y_m=0.5, heading_rad=0.0)
STATE_AT_START = RegionState(
    region=(1, 0),
    mu_x=(0.0, 1.0, 0.0),
    mu_y=(1.0, 0.0, 0.0),
    pose=START,
    goal_probability=1.0,
    confidence=Confidence.OK,
)
TRUTH = Odometry(pose=START, twist=Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0))


def end_of_path(path: int) -> Transition:
    return Transition(
        state=(1, 1),
        action=6,
        reward=1.0,
        next_state=(1, 0),
        temperature=0.0,
        trial=0,
        path=path,
        outcome=PathOutcome.GOAL,
    )


@pytest.fixture
def domain() -> Iterator[int]:
    number = graphs.fresh_domain()
    graphs.join(number)
    yield number
    rclpy.try_shutdown()


@pytest.mark.parametrize('path', [0, 1])
def test_it_listens_to_ends_once_it_hears_ticks_and_judges_what_it_hears(
    domain: int, path: int
) -> None:
    results: list[PathResult | None] = []
    policy = Policy.unlearned(RegionMap())
    evaluator = PathEvaluator([START], policy.regions)
    monitor = RunMonitor(evaluator, policy, 'crisp', results.append)
    executor = SingleThreadedExecutor()
    executor.add_node(monitor)
    with graphs.onlooker(domain) as (node, serve_until):
        truths = node.create_publisher(OdometryMsg, GROUND_TRUTH, DEEP_QOS)
        states = node.create_publisher(DiagnosticArray, STATE, DEEP_QOS)
        transitions = node.create_publisher(DiagnosticArray, TRANSITION, DEEP_QOS)

        def served(*, listening: int) -> bool:
            executor.spin_once(timeout_sec=0.01)
            matched = (truths, states) if not listening else (transitions,)
            return all(publisher.get_subscription_count() for publisher in matched)

        # The end of the monitor of the test before may still be on its way.
        assert serve_until(
            lambda: served(listening=0) and not transitions.get_subscription_count(), 90.0
        )
        truths.publish(odometry_to_raw(TRUTH, 40, frame_id=MAP_FRAME))
        executor.spin_once(timeout_sec=0.1)
        assert not transitions.get_subscription_count()
        states.publish(state_to_raw(STATE_AT_START, 40))
        assert serve_until(lambda: served(listening=1), 90.0)
        transitions.publish(transition_to_raw(end_of_path(path), 40))
        assert serve_until(lambda: served(listening=1) and bool(results), 90.0)
    assert [result and result.outcome for result in results] == [None] * path + ['goal']
    executor.shutdown()
    monitor.destroy_node()


MS = 1_000_000


@pytest.fixture
def results(domain: int) -> list[PathResult | None]:
    del domain
    return []


@contextmanager
def monitoring(
    results: list[PathResult | None], *starts: Pose2, judged: bool = True
) -> Iterator[RunMonitor]:
    """Give a monitor that is fed by calls, and what it acknowledges."""
    policy = Policy.unlearned(RegionMap())
    evaluator = PathEvaluator(starts, policy.regions, judged=judged)
    monitor = RunMonitor(evaluator, policy, 'crisp', results.append)
    monitor._acknowledger = Mock()
    yield monitor
    monitor.destroy_node()


def feed(
    monitor: RunMonitor,
    stamp_ns: int,
    *,
    certain: bool = True,
    judged: bool = True,
    off_m: float = 0.0,
) -> None:
    """Feed a tick of the robot at its start."""
    if judged:
        truth = odometry_to_raw(TRUTH, stamp_ns, frame_id=MAP_FRAME)
        monitor._collect(GROUND_TRUTH, stamp_ns, truth)
    confidence = Confidence.OK if certain else Confidence.UNCERTAIN
    pose = replace(START, x_m=START.x_m + off_m)
    state = replace(STATE_AT_START, confidence=confidence, pose=pose)
    monitor._collect(STATE, stamp_ns, state_to_raw(state, stamp_ns))


def test_every_tenth_tick_is_acknowledged_and_the_last_in_silence(
    results: list[PathResult | None],
) -> None:
    with monitoring(results, START) as monitor:
        monitor._evaluate_pending()
        assert monitor.progress == Progress(path=0, placed=False, last_ns=0, truth=None)
        for tick in range(1, 26):
            feed(monitor, 40 * MS * tick)
        acknowledged: Any = monitor._acknowledger
        assert [call.args for call in acknowledged.acknowledge.call_args_list] == [
            (400 * MS,), (800 * MS,)
        ]  # fmt: skip
        assert monitor.progress == Progress(path=0, placed=True, last_ns=1000 * MS, truth=START)
        assert monitor.began_ns == 40 * MS
        monitor._evaluate_pending()
        assert acknowledged.acknowledge.call_args.args == (1000 * MS,)


def test_an_outcome_without_its_tick_counts_after_a_second_of_silence(
    results: list[PathResult | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [50.0]
    monkeypatch.setattr(monitor_module, 'time', SimpleNamespace(monotonic=lambda: now[0]))
    with monitoring(results, START) as monitor:
        feed(monitor, 40 * MS)
        moving = replace(end_of_path(0), outcome=None)
        monitor._on_action(40 * MS, transition_to_raw(moving, 40 * MS))
        monitor._on_action(80 * MS, transition_to_raw(end_of_path(0), 80 * MS))
        for now[0] in (50.0, 51.0):
            monitor._evaluate_pending()
            assert results == []
        now[0] = 51.1
        monitor._evaluate_pending()
    assert [result and result.outcome for result in results] == ['goal']


def test_a_clock_that_goes_back_by_more_than_a_tenth_of_a_second_is_another(
    results: list[PathResult | None],
) -> None:
    with monitoring(results, START) as monitor:
        feed(monitor, 500 * MS)
        feed(monitor, 400 * MS)
        assert (monitor.began_ns, monitor.progress.placed) == (500 * MS, True)
        monitor._collect(STATE, 399 * MS, state_to_raw(STATE_AT_START, 399 * MS))
        assert (monitor.began_ns, monitor.progress.placed) == (399 * MS, False)
        assert monitor.progress.last_ns == 0


def test_without_a_truth_a_tick_is_a_state_that_is_certain(
    results: list[PathResult | None],
) -> None:
    with monitoring(results, START, judged=False) as monitor:
        feed(monitor, 40 * MS, certain=False, judged=False)
        assert not monitor.progress.placed
        feed(monitor, 80 * MS, judged=False)
        expected = Progress(path=0, placed=True, last_ns=80 * MS, truth=START)
        assert monitor.progress == expected
        monitor._on_action(80 * MS, transition_to_raw(end_of_path(0), 80 * MS))
    assert [result and result.outcome for result in results] == ['declared']


def test_only_certain_states_are_compared_with_the_truth(
    results: list[PathResult | None],
) -> None:
    with monitoring(results, START) as monitor:
        for path, certain in enumerate((False, True)):
            for tick in (1, 2):
                feed(monitor, 40 * MS * (2 * path + tick), certain=certain, off_m=0.25)
            stamp_ns = 80 * MS * (path + 1)
            monitor._on_action(stamp_ns, transition_to_raw(end_of_path(path), stamp_ns))
    errors_m = [result.pose_error_m.get('max') for result in results if result is not None]
    assert errors_m == [None, pytest.approx(0.25)]


def test_the_region_that_the_controller_reached_is_the_goal(
    results: list[PathResult | None],
) -> None:
    with monitoring(results, START) as monitor:
        feed(monitor, 40 * MS)
        elsewhere = replace(end_of_path(0), next_state=(2, 2))
        monitor._on_action(40 * MS, transition_to_raw(elsewhere, 40 * MS))
        feed(monitor, 80 * MS)
        bump = replace(end_of_path(1), next_state=(1, 0), outcome=PathOutcome.BUMP)
        monitor._on_action(80 * MS, transition_to_raw(bump, 80 * MS))
        assert monitor._evaluator.regions.goal == (2, 2)
    assert [result and result.outcome for result in results] == ['false-goal', 'bump']


def test_a_table_that_is_learned_replaces_the_policy(results: list[PathResult | None]) -> None:
    with monitoring(results, START) as monitor:
        before = monitor._policy
        monitor._on_q_table(0, q_table_to_raw(np.zeros((3, 3, 8))))
        assert monitor._policy is before
        q = np.zeros((3, 3, 8))
        q[..., 2] = 1.0
        monitor._on_q_table(0, q_table_to_raw(q))
        away = replace(STATE_AT_START, region=(1, 1), mu_y=(0.0, 1.0, 0.0))
        for tick, confidence in ((1, Confidence.OK), (2, Confidence.UNCERTAIN)):
            state = replace(away, confidence=confidence)
            monitor._on_tick(40 * MS * tick, START, state_to_raw(state, 40 * MS * tick))
        commanded_rad = [tick.commanded_heading_rad for tick in monitor._evaluator._ticks]
        assert commanded_rad == [pytest.approx(math.pi / 2), None]
        assert np.array_equal(monitor._policy.q, q)
        with pytest.raises(MessageError, match='does not fit the regions'):
            monitor._on_q_table(0, q_table_to_raw(np.zeros((2, 3, 8))))


@pytest.mark.parametrize('success', [False, True])
def test_a_path_begins_once_the_controller_has_agreed(
    results: list[PathResult | None],
    success: bool,  # noqa: FBT001
) -> None:
    with monitoring(results) as monitor:
        assert not monitor._on_start(Trigger.Request(), Trigger.Response()).success
        feed(monitor, 40 * MS)
        monitor._start = controller = Mock()
        assert monitor._on_start(Trigger.Request(), Trigger.Response()).success
        assert controller.call_async.call_count == 1
        call = Mock(result=lambda: Trigger.Response(success=success))
        monitor._on_started(call)
        assert monitor.progress.placed != success
