"""The launcher's own node: when it listens, and what it makes of what it hears, over real DDS."""

from collections.abc import Iterator

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry as OdometryMsg
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor

from goalreach_bringup.launch.path_evaluator import PathEvaluator
from goalreach_bringup.launch.ros.monitor import RunMonitor
from goalreach_evaluation.path_metrics import PathResult
from goalreach_learning.policy import Policy
from goalreach_msgs_py.diagnostic_messages import state_to_raw, transition_to_raw
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
