"""The lockstep clock over real DDS: accepted answers, windows, and reports of silent nodes."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
import itertools
from pathlib import Path
import signal

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import pytest
from sensor_msgs.msg import CameraInfo, Image, JointState

from goalreach_msgs_py.ros.acknowledgement import Acknowledger
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, SENSOR_QOS
import graphs
from ros_robot import LIMIT_S, RobotGraph, node_process, robot_graph

pytestmark = pytest.mark.graph

QUIET_S = 0.4
PERIOD_NS = 40_000_000


@contextmanager
def lockstep(home: Path, **parameters: object) -> Iterator[RobotGraph]:
    """Run the robot in lockstep; this process plays all other nodes."""
    with robot_graph(home, clock='lockstep', **parameters) as robot:
        node = robot.node
        for message_type, topic in (
            (Image, '/camera/image_raw'),
            (CameraInfo, '/camera/camera_info'),
            (JointState, '/joint_states'),
            (Odometry, '/odom'),
            (PoseWithCovarianceStamped, '/pose'),
            (DiagnosticArray, '/state'),
        ):
            node.create_subscription(message_type, topic, lambda _: None, SENSOR_QOS)
        node.create_publisher(PoseWithCovarianceStamped, '/pose', RELIABLE_QOS)
        node.create_publisher(DiagnosticArray, '/state', RELIABLE_QOS)
        if 'consumers' not in parameters:
            robot.wait(lambda: bool(robot.clock_ns))
        yield robot


def answer(robot: RobotGraph, linear: float = 0.0) -> None:
    """Answer the last tick and wait for the next."""
    stamp_ns = robot.clock_ns[-1]
    robot.drive(linear, 0.0, stamp_ns)
    robot.turn_head(stamp_ns)
    robot.wait(lambda: robot.clock_ns[-1] > stamp_ns)


def test_a_tick_comes_when_both_commands_of_its_stamp_are_there(tmp_path: Path) -> None:
    with lockstep(tmp_path) as robot:
        for _ in range(5):
            answer(robot)
        stamp_ns = robot.clock_ns[-1]
        robot.turn_head(stamp_ns)
        robot.serve_until(lambda: False, QUIET_S)
        assert robot.clock_ns[-1] == stamp_ns
        robot.drive(0.0, 0.0, stamp_ns)
        robot.wait(lambda: robot.clock_ns[-1] > stamp_ns)
        ticks_ns = sorted(set(robot.clock_ns))
        assert {b - a for a, b in itertools.pairwise(ticks_ns)} == {PERIOD_NS}
        assert robot.clock_ns == sorted(robot.clock_ns)


def test_late_repeated_and_foreign_commands_do_not_count(tmp_path: Path) -> None:
    with lockstep(tmp_path, start_pose='[1.778, 4.0, -1.5708]') as robot:
        answer(robot)
        stamp_ns = robot.clock_ns[-1]
        for wrong_ns in (stamp_ns - PERIOD_NS, 0, stamp_ns + PERIOD_NS, stamp_ns + 1):
            robot.drive(0.5, 0.0, wrong_ns)
            robot.turn_head(wrong_ns)
        robot.drive(0.0, 0.0, stamp_ns)
        robot.drive(0.5, 0.0, stamp_ns)  # the second of the same stamp
        robot.serve_until(lambda: False, QUIET_S)
        assert robot.clock_ns[-1] == stamp_ns
        robot.turn_head(stamp_ns)
        robot.wait(lambda: robot.clock_ns[-1] > stamp_ns)
        robot.wait(lambda: len(robot.truth) >= len(set(robot.clock_ns)))
        assert robot.clock_ns[-1] == stamp_ns + PERIOD_NS
        assert robot.speed_m_per_s == 0.0
        assert robot.pose.y_m == pytest.approx(4.0)


def test_a_silent_node_is_named_and_the_last_tick_repeated(tmp_path: Path) -> None:
    with lockstep(tmp_path, answer_timeout_s=1.0) as robot:
        answer(robot)
        stamp_ns = robot.clock_ns[-1]
        robot.turn_head(stamp_ns)
        robot.wait(lambda: 'did not answer on' in robot.log)
        # Neither pose nor state came: the first of the chain is the one to look at.
        assert 'landmark_localizer did not answer on /pose' in robot.log
        assert robot.clock_ns.count(stamp_ns) > 1
        assert robot.clock_ns == sorted(robot.clock_ns)
        answer(robot)


def test_names_the_nodes_that_never_started(tmp_path: Path) -> None:
    with robot_graph(tmp_path, clock='lockstep', answer_timeout_s=0.5) as robot:
        # This process speaks on /cmd_vel and /head/command once it is found; the rest is missing.
        robot.wait(lambda: 'lockstep waits for landmark_localizer, state_estimator' in robot.log)
        assert not robot.clock_ns


def test_it_is_never_further_ahead_of_a_consumer_than_its_window(tmp_path: Path) -> None:
    with lockstep(tmp_path, consumers='onlooker', answer_timeout_s=1.0) as robot:
        robot.wait(lambda: 'lockstep waits for onlooker' in robot.log)
        assert not robot.clock_ns
        acknowledger = Acknowledger(robot.node, window_ticks=20)
        robot.wait(lambda: bool(robot.clock_ns))
        for _ in range(19):
            answer(robot)
        stamp_ns = robot.clock_ns[-1]
        robot.drive(0.0, 0.0, stamp_ns)
        robot.turn_head(stamp_ns)
        robot.wait(lambda: 'onlooker did not answer on /_acknowledged/onlooker' in robot.log)
        assert robot.clock_ns[-1] == stamp_ns
        acknowledger.acknowledge(stamp_ns - 18 * PERIOD_NS)
        robot.wait(lambda: robot.clock_ns[-1] > stamp_ns)
        answer(robot)
        (publisher,) = (p for p in robot.node.publishers if 'acknowledged' in p.topic_name)
        robot.node.destroy_publisher(publisher)
        robot.wait(lambda: 'onlooker has ended; the run continues without it' in robot.log)
        for _ in range(30):
            answer(robot)


def test_a_pause_withholds_the_answered_tick(tmp_path: Path) -> None:
    with lockstep(tmp_path) as robot:
        answer(robot)
        assert robot.pause(on=True).success
        stamp_ns = robot.clock_ns[-1]
        robot.drive(0.0, 0.0, stamp_ns)
        robot.turn_head(stamp_ns)
        robot.serve_until(lambda: False, QUIET_S)
        assert robot.clock_ns[-1] == stamp_ns
        assert robot.pause(on=False).success
        robot.wait(lambda: robot.clock_ns[-1] == stamp_ns + PERIOD_NS)


def test_a_reset_between_two_ticks_does_not_turn_the_clock_back(tmp_path: Path) -> None:
    with lockstep(tmp_path) as robot:
        for y_m in (1.0, 4.0, 2.0):
            answer(robot, linear=0.3)
            assert robot.set_parameter('start_pose', [1.0, y_m, 0.0]).successful
            assert robot.reset().success
            answer(robot)
            robot.wait(lambda: len(robot.truth) >= len(robot.clock_ns))
            assert robot.pose.y_m == pytest.approx(y_m)
        assert robot.clock_ns == sorted(set(robot.clock_ns))


def test_a_node_that_hangs_is_named_and_resumes(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    robot_parameters = {'clock': 'lockstep', 'answer_timeout_s': 1.0}
    with ExitStack() as stack:
        node, serve_until = stack.enter_context(graphs.onlooker(domain))

        def start(name: str, **parameters: object) -> tuple[object, Path]:
            return stack.enter_context(
                node_process(name, parameters, domain=domain, home=tmp_path)
            )

        _, log_path = start('nomad200', **robot_parameters)
        start('landmark_localizer')
        start('goal_reaching_controller')
        robot = RobotGraph(node, serve_until, log_path, speaks=False)
        robot.wait(lambda: 'lockstep waits for state_estimator' in robot.log)
        assert not robot.clock_ns
        estimator, _ = stack.enter_context(
            node_process('state_estimator', {}, domain=domain, home=tmp_path)
        )
        robot.wait(lambda: len(robot.clock_ns) > 20, LIMIT_S)
        estimator.send_signal(signal.SIGSTOP)
        try:
            robot.wait(lambda: 'state_estimator did not answer on /state' in robot.log)
        finally:
            estimator.send_signal(signal.SIGCONT)
        ticks = len(set(robot.clock_ns))
        robot.wait(lambda: len(set(robot.clock_ns)) > ticks + 20)
        assert robot.clock_ns == sorted(robot.clock_ns)
