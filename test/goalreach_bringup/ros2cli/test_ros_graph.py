from __future__ import annotations

from collections.abc import Iterator
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
from typing import IO

import pytest

import goalreach_msgs_py
from graphs import fresh_domain
from ros2_words import ROS2, ros2

pytestmark = pytest.mark.graph

NODE = Path(__file__).with_name('graph_node.py')
PROFILE = Path(goalreach_msgs_py.__file__).parent / 'config' / 'fastdds.xml'


@pytest.fixture(scope='module')
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    kept = {k: v for k, v in os.environ.items() if k != 'FASTRTPS_DEFAULT_PROFILES_FILE'}
    return kept | {
        'GOALREACH_ROS2_HANDED_OVER': '1',  # so that a real ros2 is not used
        'ROS_DOMAIN_ID': str(fresh_domain()),
        'ROS_LOG_DIR': str(tmp_path_factory.mktemp('log')),
    }


@pytest.fixture(scope='module')
def heard(environment: dict[str, str]) -> Iterator[IO[str]]:
    """Start the node as `goalreach run` starts its nodes: on the loopback interface only."""
    node = subprocess.Popen(
        [sys.executable, str(NODE)],
        env=environment | {'FASTRTPS_DEFAULT_PROFILES_FILE': str(PROFILE)},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert node.stdout is not None
    assert node.stdout.readline() == 'ready\n'
    yield node.stdout
    node.terminate()
    assert node.wait(timeout=20) == 0


@pytest.fixture
def graph(environment: dict[str, str], heard: IO[str]) -> dict[str, str]:
    assert heard.readable()
    return environment


def start(environment: dict[str, str], *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*ROS2, *arguments],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_topic_list_has_types(graph: dict[str, str]) -> None:
    expected = (
        '/array [std_msgs/msg/Float64MultiArray]\n'
        '/chatter [std_msgs/msg/String]\n'
        '/in [std_msgs/msg/String]\n'
        '/parameter_events [rcl_interfaces/msg/ParameterEvent]\n'
        '/point [geometry_msgs/msg/Point]\n'
        '/rosout [rcl_interfaces/msg/Log]\n'
        '/state [diagnostic_msgs/msg/DiagnosticArray]\n'
    )
    assert ros2(graph, 'topic', 'list', '-t') == (0, expected, '')


def test_topic_info_verbose_shows_the_endpoint(graph: dict[str, str]) -> None:
    status, out, _ = ros2(graph, 'topic', 'info', '-v', '/chatter')
    assert status == 0
    assert out.startswith(
        'Type: std_msgs/msg/String\n\nPublisher count: 1\n\n'
        'Node name: talker\nNode namespace: /ns\nTopic type: std_msgs/msg/String\n'
        'Topic type hash: RIHS01_'
    )
    assert '  Reliability: RELIABLE\n' in out
    assert out.endswith('\n\nSubscription count: 0\n\n')


def test_unknown_topic_is_one_line_and_status_1(graph: dict[str, str]) -> None:
    expected = (1, '', "Unknown topic '/nope'\n")
    assert ros2(graph, 'topic', 'info', '/nope', '--spin-time', '1') == expected


def test_node_list_hides_the_tool_itself(graph: dict[str, str]) -> None:
    assert ros2(graph, 'node', 'list') == (0, '/ns/talker\n', '')


def test_node_info_lists_connections(graph: dict[str, str]) -> None:
    status, out, _ = ros2(graph, 'node', 'info', '/ns/talker')
    assert status == 0
    assert out.startswith(
        '/ns/talker\n'
        '  Subscribers:\n'
        '    /in: std_msgs/msg/String\n'
        '  Publishers:\n'
        '    /array: std_msgs/msg/Float64MultiArray\n'
    )
    assert '  Service Servers:\n    /ns/switch: std_srvs/srv/SetBool\n' in out
    assert out.endswith('  Service Clients:\n\n  Action Servers:\n\n  Action Clients:\n\n')


def test_service_list_and_call(graph: dict[str, str]) -> None:
    status, out, _ = ros2(graph, 'service', 'list', '-t')
    assert status == 0
    assert out.startswith('/ns/switch [std_srvs/srv/SetBool]\n/ns/talker/describe_parameters [')
    called = ros2(graph, 'service', 'call', '/ns/switch', 'std_srvs/srv/SetBool', '{data: true}')
    expected = (
        'waiting for service to become available...\n'
        'requester: making request: std_srvs.srv.SetBool_Request(data=True)\n\n'
        "response:\nstd_srvs.srv.SetBool_Response(success=True, message='done')\n\n"
    )
    assert called == (0, expected, '')


def test_call_with_the_type_of_another_service_is_refused(graph: dict[str, str]) -> None:
    status, _, error = ros2(graph, 'service', 'call', '/ns/switch', 'std_srvs/srv/Trigger')
    assert status == 1
    assert error == (
        "The service '/ns/switch' has the type 'std_srvs/srv/SetBool', "
        "not 'std_srvs/srv/Trigger'\n"
    )


def test_param_list_names_node(graph: dict[str, str]) -> None:
    expected = (
        '/ns/talker:\n  gains.angular\n  speed\n  start_type_description_service\n  use_sim_time\n'
    )
    assert ros2(graph, 'param', 'list') == (0, expected, '')


def test_param_set_get_dump_and_refusals(graph: dict[str, str]) -> None:
    changed = ros2(graph, 'param', 'set', '/ns/talker', 'speed', '1.75')
    assert changed == (0, 'Set parameter successful\n', '')
    got = ros2(graph, 'param', 'get', '/ns/talker', 'speed')
    assert got == (0, 'Double value is: 1.75\n', '')
    got = ros2(graph, 'param', 'get', 'ns/talker', 'gains.angular', '--hide-type')
    assert got == (0, '[1.0, 2.0]\n', '')
    dumped = (
        '/ns/talker:\n'
        '  ros__parameters:\n'
        '    gains:\n'
        '      angular:\n'
        '      - 1.0\n'
        '      - 2.0\n'
        '    speed: 1.75\n'
        '    start_type_description_service: true\n'
        '    use_sim_time: false\n\n'
    )
    assert ros2(graph, 'param', 'dump', '/ns/talker') == (0, dumped, '')
    status, out, error = ros2(graph, 'param', 'set', '/ns/talker', 'speed', '7.0')
    assert (status, out) == (1, '')
    assert error.startswith('Setting parameter failed: Parameter speed out of range')
    for value in ('9' * 20, '2026-11-30', '{a: 1}'):  # no type of a parameter holds them
        status, out, error = ros2(graph, 'param', 'set', '/ns/talker', 'speed', value)
        assert (status, out) == (1, '')
        assert error.startswith('Setting parameter failed: ')
    status, out, error = ros2(graph, 'param', 'get', '/ns/nobody', 'speed', '--spin-time', '0.5')
    assert (status, out, error) == (1, '', 'Node not found\n')


def test_echo_waits_for_latched_messages_of_reliable_publishers(graph: dict[str, str]) -> None:
    expected = (
        "header:\n  stamp:\n    sec: 0\n    nanosec: 0\n  frame_id: ''\n"
        "status:\n- level: \"\\x01\"\n  name: region_state\n  message: ''\n  hardware_id: ''\n"
        "  values:\n  - key: mu_x.FRONT\n    value: '0.25'\n---\n"
    )
    assert ros2(graph, 'topic', 'echo', '--once', '/state') == (0, expected, '')


def test_echo_hears_best_effort_publishers(graph: dict[str, str]) -> None:
    expected = (0, 'x: 1.0\ny: -2.5\nz: 1.0e-07\n---\n', '')
    assert ros2(graph, 'topic', 'echo', '--once', '/point') == expected


def test_echo_field_truncates_and_names_a_wrong_field(graph: dict[str, str]) -> None:
    status, out, _ = ros2(graph, 'topic', 'echo', '--once', '/array', '-l', '2')
    assert status == 0
    assert out.endswith("data:\n- 0.0\n- 1.0\n- '...'\n---\n")
    status, out, _ = ros2(
        graph, 'topic', 'echo', '--once', '/state', '--field', 'status.[0].values.[0].value'
    )
    assert (status, out) == (0, '0.25\n---\n')
    status, _, error = ros2(graph, 'topic', 'echo', '--once', '/point', '--field', 'w')
    assert (status, error) == (1, "Invalid field 'w': 'Point' object has no attribute 'w'\n")


def test_pub_reaches_the_subscription(graph: dict[str, str], heard: IO[str]) -> None:
    text = '{data: good morning}'
    status, out, error = ros2(graph, 'topic', 'pub', '-t', '2', '-r', '50', '/in',
                              'std_msgs/msg/String', text)  # fmt: skip
    assert (status, error) == (0, '')
    assert out.endswith(
        'publisher: beginning loop\n'
        "publishing #1: std_msgs.msg.String(data='good morning')\n\n"
        "publishing #2: std_msgs.msg.String(data='good morning')\n\n"
    )
    assert heard.readline() == 'heard good morning\n'
    assert heard.readline() == 'heard good morning\n'


def test_hz_measures_the_rate_and_ends_with_ctrl_c(graph: dict[str, str]) -> None:
    command = start(graph, 'topic', 'hz', '/chatter', '-w', '10')
    assert command.stdout is not None
    average, spread = command.stdout.readline(), command.stdout.readline()
    command.send_signal(signal.SIGINT)
    out, error = command.communicate(timeout=20)
    match = re.fullmatch(r'average rate: (\d+\.\d{3})\n', average)
    assert match is not None
    assert 5.0 < float(match[1]) < 40.0  # 20 Hz on a machine that may be busy
    assert re.fullmatch(
        r'\tmin: \d\.\d{3}s max: \d\.\d{3}s std dev: \d\.\d{5}s window: 10\n', spread
    )
    assert error == ''
    assert command.returncode == 130
    assert 'Traceback' not in out


def test_echo_ends_quietly_when_nobody_reads(graph: dict[str, str]) -> None:
    command = start(graph, 'topic', 'echo', '/chatter')
    assert command.stdout is not None
    assert command.stderr is not None
    assert command.stdout.readline() == "data: 'hello: world'\n"
    command.stdout.close()
    assert command.wait(timeout=20) == 128 + signal.SIGPIPE
    assert command.stderr.read() == ''
    command.stderr.close()


def test_echo_ends_with_sigterm(graph: dict[str, str]) -> None:
    command = start(graph, 'topic', 'echo', '/chatter')
    assert command.stdout is not None
    assert command.stdout.readline() == "data: 'hello: world'\n"
    command.terminate()
    _, error = command.communicate(timeout=20)
    assert (command.returncode, error) == (143, '')
