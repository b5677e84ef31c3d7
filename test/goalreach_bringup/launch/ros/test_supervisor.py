"""The real graph: four processes, real images, real DDS, one path to the goal."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMsg
import psutil
import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan
from std_msgs.msg import Float64MultiArray
from visualization_msgs.msg import MarkerArray

from goalreach_bags.reader import BagReader
from goalreach_lab.rigs.processes import descendants_of, find_descendant
from goalreach_msgs_py.diagnostic_messages import state_from_raw, transition_from_raw
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, stamp_from_msg
from goalreach_msgs_py.topics import NODES
from goalreach_msgs_py.values import PathOutcome
import graphs

pytestmark = pytest.mark.graph

TYPES = {
    '/clock': 'rosgraph_msgs/msg/Clock',
    '/camera/image_raw': 'sensor_msgs/msg/Image',
    '/camera/camera_info': 'sensor_msgs/msg/CameraInfo',
    '/odom': 'nav_msgs/msg/Odometry',
    '/joint_states': 'sensor_msgs/msg/JointState',
    '/bumpers': 'sensor_msgs/msg/LaserScan',
    '/ground_truth/odom': 'nav_msgs/msg/Odometry',
    '/arena/markers': 'visualization_msgs/msg/MarkerArray',
    '/pose': 'geometry_msgs/msg/PoseWithCovarianceStamped',
    '/landmarks': 'geometry_msgs/msg/PolygonStamped',
    '/head/command': 'sensor_msgs/msg/JointState',
    '/state': 'diagnostic_msgs/msg/DiagnosticArray',
    '/cmd_vel': 'geometry_msgs/msg/TwistStamped',
    '/q_learning/transition': 'diagnostic_msgs/msg/DiagnosticArray',
    '/q_learning/q_table': 'std_msgs/msg/Float64MultiArray',
    '/path': 'nav_msgs/msg/Path',
    '/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray',
}
LATCHED = {'/arena/markers', '/q_learning/q_table'}
SENSOR = {'/camera/image_raw', '/camera/camera_info'}
CLASSES = {
    '/clock': Clock,
    '/camera/image_raw': Image,
    '/camera/camera_info': CameraInfo,
    '/odom': Odometry,
    '/joint_states': JointState,
    '/bumpers': LaserScan,
    '/pose': PoseWithCovarianceStamped,
    '/landmarks': PolygonStamped,
    '/head/command': JointState,
    '/state': DiagnosticArray,
    '/cmd_vel': TwistStamped,
    '/q_learning/transition': DiagnosticArray,
    '/q_learning/q_table': Float64MultiArray,
    '/arena/markers': MarkerArray,
    '/path': PathMsg,
}


def read_messages(bag: Path) -> dict[str, list[Any]]:
    """Return the messages of a bag by topic; its recorder misses none."""
    heard: dict[str, list[Any]] = {topic: [] for topic in CLASSES}
    with BagReader(bag) as reader:
        for message in reader.messages(CLASSES):
            content = deserialize_message(message.data, CLASSES[message.topic])
            heard[message.topic].append(content)
    return heard


def shared_memory_until_the_end(stack: subprocess.Popen[str]) -> set[Path]:
    found: set[Path] = set()
    while stack.poll() is None:
        found |= graphs.shared_memory_of(stack.pid)
        with contextlib.suppress(subprocess.TimeoutExpired):
            stack.wait(0.1)
    return found


def stamps(messages: list[Any]) -> set[int]:
    return {stamp_from_msg(message.header.stamp) for message in messages}


@pytest.mark.parametrize('composed', [False, True], ids=['processes', 'composed'])
def test_one_path_to_the_goal(tmp_path: Path, *, composed: bool) -> None:
    domain = graphs.fresh_domain()
    summary_path = tmp_path / 'out.json'
    arguments = ['run', '--paths', '1', '--start', '0.6,2.6,-90', '--clock', 'lockstep']
    arguments += ['--seed', '7', '--summary', str(summary_path)] + ['--composed'] * composed
    arguments += ['--record', str(tmp_path / 'bag')]
    with graphs.goalreach(arguments, domain=domain, home=tmp_path) as stack:
        segments = shared_memory_until_the_end(stack)
        output, _ = stack.communicate(timeout=10.0)
        assert stack.returncode == 0, output
    heard = read_messages(tmp_path / 'bag')
    shutil.rmtree(tmp_path / 'bag')
    check_stamps(heard)
    check_content(heard)
    check_summary(json.loads(summary_path.read_text()))
    assert segments
    assert not graphs.abandoned(segments)


def check_topics(node: Node) -> None:
    types = dict(node.get_topic_names_and_types())
    for topic, name in TYPES.items():
        assert types[topic] == [name]
        for info in node.get_publishers_info_by_topic(topic):
            profile = info.qos_profile
            latched = profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
            assert profile.reliability is ReliabilityPolicy.RELIABLE, topic
            assert latched == (topic in LATCHED), topic
    truth_readers = {
        i.node_name for i in node.get_subscriptions_info_by_topic('/ground_truth/odom')
    }
    assert truth_readers <= {'run_monitor'}


def check_stamps(heard: dict[str, list[Any]]) -> None:
    """Every command answers a state, which answers a pose, which answers an image."""
    commands = stamps(heard['/cmd_vel'])
    assert len(commands) > 100
    for topic in ('/state', '/pose', '/landmarks', '/head/command', *SENSOR):
        assert commands <= stamps(heard[topic]), topic
    images = stamps(heard['/camera/image_raw'])
    for topic in ('/odom', '/joint_states', '/bumpers'):
        assert images <= stamps(heard[topic]), topic
    clock = [stamp_from_msg(message.clock) for message in heard['/clock']]
    assert clock == sorted(clock)


def check_content(heard: dict[str, list[Any]]) -> None:
    image = heard['/camera/image_raw'][-1]
    assert (image.encoding, image.width, image.height) == ('mono8', 640, 480)
    assert image.header.frame_id == heard['/camera/camera_info'][-1].header.frame_id
    assert heard['/pose'][-1].header.frame_id == 'map'
    assert list(heard['/joint_states'][-1].name) == ['turret_joint', 'pan_joint', 'tilt_joint']
    assert [d.size for d in heard['/q_learning/q_table'][-1].layout.dim] == [3, 3, 8]
    assert heard['/arena/markers'][-1].markers
    assert heard['/path'][-1].poses
    transitions = [
        transition_from_raw(serialize_message(m)) for m in heard['/q_learning/transition']
    ]
    ends = [(t.outcome, t.reward) for t in transitions if t.outcome is not None]
    assert ends == [(PathOutcome.GOAL, 1.0)]
    for earlier, later in itertools.pairwise(transitions):
        assert earlier.next_state == later.state
    memberships = [state_from_raw(serialize_message(message)) for message in heard['/state']]
    assert all(abs(sum(state.mu_x) - 1.0) < 1e-9 for state in memberships)


def check_summary(summary: dict[str, Any]) -> None:
    (path,) = summary['paths']
    assert path['outcome'] == 'goal'
    assert path['start'] == pytest.approx([0.6, 2.6, -1.5707963])
    assert 1.0 < path['length_m'] < 3.0
    assert 2.0 < path['duration_s'] < 30.0
    assert 0.0 < path['pose_error_m']['rms'] < 0.05
    assert summary['success_rate'] == 1.0
    assert (summary['seed'], summary['mode'], summary['policy']) == (7, 'fuzzy', 'learned')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM], ids=['ctrl-c', 'sigterm'])
def test_ends_cleanly_when_asked(tmp_path: Path, number: signal.Signals) -> None:
    domain = graphs.fresh_domain()
    commands: list[TwistStamped] = []
    with graphs.onlooker(domain) as (node, serve_until):
        graphs.collect(node, TwistStamped, '/cmd_vel', RELIABLE_QOS, commands)
        with graphs.goalreach(['run'], domain=domain, home=tmp_path) as stack:
            assert serve_until(lambda: len(commands) > 10, 90.0), stack.communicate()[0]
            check_topics(node)
            assert all(find_descendant(stack.pid, name) for name in NODES)
            processes = descendants_of(stack.pid)
            segments = graphs.shared_memory_of(stack.pid)
            stack.send_signal(number)
            output, _ = stack.communicate(timeout=10.0)
            assert stack.returncode == 0, output
        assert serve_until(lambda: not any(map(psutil.pid_exists, processes)), 90.0)
    assert segments
    assert not graphs.abandoned(segments)
    for name in NODES:
        assert f'{name} is up' in output
    assert 'error' not in output


def test_no_node_survives_a_launcher_that_is_killed(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    with (
        graphs.onlooker(domain) as (node, serve_until),
        graphs.goalreach(['run'], domain=domain, home=tmp_path) as stack,
    ):
        commands: list[TwistStamped] = []
        graphs.collect(node, TwistStamped, '/cmd_vel', RELIABLE_QOS, commands)
        assert serve_until(lambda: len(commands) > 5, 90.0), stack.communicate()[0]
        processes = descendants_of(stack.pid)
        stack.kill()
        assert serve_until(lambda: not any(map(psutil.pid_exists, processes)), 90.0)


@pytest.mark.parametrize(
    ('module', 'override', 'said'),
    [
        ('goalreach_sim.nomad200_node', 'watchdog_s:=-1.0', 'watchdog_s = -1.0: must be'),
        ('goalreach_sim.nomad200_node', 'clock:=fast', "clock = 'fast': must be one of realtime"),
        ('goalreach_perception.landmark_localizer_node', 'landmarks_m:=[1.0]', 'landmarks_m = '),
        ('goalreach_perception.state_estimator_node', 'x_knots_m:=[3.0, 1.0]', 'x_knots_m = '),
        (
            'goalreach_learning.goal_reaching_controller_node',
            'mode:=bold',
            "mode = 'bold': must be",
        ),
        ('goalreach_learning.goal_reaching_controller_node', 'policy:=/none', '/none: cannot be'),
    ],
)
def test_a_node_refuses_a_bad_parameter_in_one_line(
    tmp_path: Path, module: str, override: str, said: str
) -> None:
    command = [sys.executable, '-m', module, '--ros-args', '-p', override]
    environment = graphs.graph_environment(graphs.fresh_domain(), tmp_path)
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=30.0, check=False
    )
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert 'Traceback' not in done.stderr


def cpu_seconds(pid: int) -> float:
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def test_a_node_alone_waits_without_spinning_a_core(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    module = 'goalreach_perception.landmark_localizer_node'
    environment = graphs.graph_environment(domain, tmp_path)
    with graphs.onlooker(domain) as (node, serve_until):
        process = subprocess.Popen([sys.executable, '-m', module], env=environment)
        try:
            up = serve_until(lambda: 'landmark_localizer' in node.get_node_names(), 90.0)
            assert up
            loads = []
            for _ in range(3):  # the first seconds may still belong to the start
                began_cpu_s, began_s = cpu_seconds(process.pid), time.monotonic()
                serve_until(lambda: False, 2.0)
                waited_s = time.monotonic() - began_s
                loads.append((cpu_seconds(process.pid) - began_cpu_s) / waited_s)
                if loads[-1] < 0.2:
                    break
            assert loads[-1] < 0.2, loads
        finally:
            process.terminate()
            assert process.wait(10.0) == 0
