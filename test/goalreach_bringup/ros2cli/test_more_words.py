from __future__ import annotations

from collections.abc import Callable, Iterator
from io import BytesIO, TextIOWrapper
from pathlib import Path
import re
import signal
import subprocess
import sys

import pytest

from goalreach_bringup.cli import main
from goalreach_msgs_py.ros.dds_profile import PROFILE_VARIABLE, fast_dds_profile
from graphs import fresh_domain, graph_environment
from ros2_words import ROS2

pytestmark = pytest.mark.graph

NODE = Path(__file__).with_name('graph_node.py')
Words = Callable[..., tuple[int, str, str]]
NODE_PARAMETERS = '/ns/talker:\n  ros__parameters:\n    speed: {speed}\n    loose: text\n'


@pytest.fixture(scope='module')
def graph(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    environment = graph_environment(fresh_domain(), tmp_path_factory.mktemp('log'))
    environment['GOALREACH_ROS2_HANDED_OVER'] = '1'  # so that a real ros2 is not used
    node = subprocess.Popen(
        [sys.executable, str(NODE)], env=environment, stdout=subprocess.PIPE, text=True
    )
    assert node.stdout is not None
    assert node.stdout.readline() == 'ready\n'
    yield environment
    node.terminate()
    node.communicate(timeout=20)
    assert node.returncode == 0


@pytest.fixture
def ros2(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Words:
    """Give a function that runs words in this process; see `ros2_words.ros2`."""

    def run(environment: dict[str, str], *arguments: str, stdin: str = '') -> tuple[int, str, str]:
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        monkeypatch.setenv(PROFILE_VARIABLE, fast_dds_profile())  # as in the other tests
        monkeypatch.setattr('sys.stdin', TextIOWrapper(BytesIO(stdin.encode())))
        try:
            status = main(['ros2', *arguments])
        except SystemExit as end:
            status = int(end.code or 0)
        out, error = capfd.readouterr()
        return status, out, error

    return run


def lines_of(environment: dict[str, str], count: int, *arguments: str) -> list[str]:
    """Return the first lines of a command that is then ended by Ctrl-C."""
    command = subprocess.Popen(
        [*ROS2, *arguments], env=environment, stdout=subprocess.PIPE, text=True
    )
    assert command.stdout is not None
    lines = [command.stdout.readline() for _ in range(count)]
    command.send_signal(signal.SIGINT)
    command.communicate(timeout=20)
    assert command.returncode == 130
    return lines


def test_names_are_found_by_type_and_types_by_name(graph: dict[str, str], ros2: Words) -> None:
    assert ros2(graph, 'topic', 'find', 'std_msgs/msg/String') == (0, '/chatter\n/in\n', '')
    assert ros2(graph, 'topic', 'find', '-c', 'std_msgs/msg/String') == (0, '2\n', '')
    assert ros2(graph, 'topic', 'find', 'std_msgs/msg/Nope') == (0, '', '')
    assert ros2(graph, 'topic', 'type', '/chatter') == (0, 'std_msgs/msg/String\n', '')
    assert ros2(graph, 'topic', 'type', '/nope', '--spin-time', '0.5') == (1, '', '')
    assert ros2(graph, 'service', 'find', 'std_srvs/srv/SetBool') == (0, '/ns/switch\n', '')
    assert ros2(graph, 'service', 'type', '/ns/switch') == (0, 'std_srvs/srv/SetBool\n', '')


def test_service_info_counts(graph: dict[str, str], ros2: Words) -> None:
    expected = 'Type: std_srvs/srv/SetBool\nClients count: 0\nServices count: 1\n'
    assert ros2(graph, 'service', 'info', '/ns/switch') == (0, expected, '')
    refused = (1, '', "Unknown service '/nope'\n")
    assert ros2(graph, 'service', 'info', '/nope', '--spin-time', '0.5') == refused


def test_events_of_a_service_are_shown(graph: dict[str, str], ros2: Words) -> None:
    echo = subprocess.Popen(
        [*ROS2, 'service', 'echo', '/ns/switch', '--flow-style'],
        env=graph,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        listening = ''
        while 'Subscription count: 1' not in listening:
            assert echo.poll() is None
            _, listening, _ = ros2(graph, 'topic', 'info', '/ns/switch/_service_event')
        called = ros2(graph, 'service', 'call', '--stdin', '/ns/switch', 'std_srvs/srv/SetBool',
                      stdin='data: true\n')  # fmt: skip
        assert called[0] == 0
        assert echo.stdout is not None
        text = ''.join(echo.stdout.readline() for _ in range(20))
    finally:
        echo.terminate()
        echo.communicate(timeout=20)
    event = (
        r'info:\n  event_type: {}\n  stamp:\n    sec: \d+\n    nanosec: \d+\n'
        r'  client_gid: \[(\d+, ){{15}}\d+\]\n  sequence_number: \d+\n'
        r'request: {}\nresponse: {}\n---\n'
    )
    first = event.format('REQUEST_RECEIVED', r'\[\{data: true\}\]', r'\[\]')
    second = event.format('RESPONSE_SENT', r'\[\]', r'\[\{success: true, message: done\}\]')
    assert re.fullmatch(first + second, text), text


def test_echo_of_a_service_that_is_not_there(graph: dict[str, str], ros2: Words) -> None:
    refused = (1, '', 'Could not load the type for the passed service\n')
    assert ros2(graph, 'service', 'echo', '/nope', '--spin-time', '0.5') == refused


def test_bandwidth_and_delay(graph: dict[str, str], ros2: Words) -> None:
    bandwidth = ''.join(lines_of(graph, 3, 'topic', 'bw', '/array', '-w', '5'))
    assert re.fullmatch(
        r'Subscribed to \[/array\]\n\d+\.\d\d KB/s from 5 messages\n'
        r'\tMessage size mean: 1\.62 KB min: 1\.62 KB max: 1\.62 KB\n',
        bandwidth,
    )
    delay = ''.join(lines_of(graph, 2, 'topic', 'delay', '/stamped', '-w', '5'))
    match = re.fullmatch(
        r'average delay: (\d\.\d{3})\n'
        r'\tmin: \d\.\d{3}s max: \d\.\d{3}s std dev: \d\.\d{5}s window: 5\n',
        delay,
    )
    assert match is not None
    assert float(match[1]) >= 2.0, 'the messages are stamped two seconds ago'
    assert ros2(graph, 'topic', 'delay', '/chatter') == (1, '', 'msg does not have header\n')


def test_filter_of_echo_and_hz(graph: dict[str, str], ros2: Words) -> None:
    passing = ros2(graph, 'topic', 'echo', '--once', '/point', '--filter', 'm.x > 0.5')
    assert passing == (0, 'x: 1.0\ny: -2.5\nz: 1.0e-07\n---\n', '')
    field = ['--field', 'y', '--filter', 'm < 0']
    assert ros2(graph, 'topic', 'echo', '--once', '/point', *field) == (0, '-2.5\n---\n', '')
    none = ros2(graph, 'topic', 'echo', '/point', '--filter', 'm.x < 0', '--timeout', '1')
    assert none == (0, '', '')
    rate = lines_of(graph, 1, 'topic', 'hz', '/chatter', '--filter', "'w' in m.data")
    assert rate[0].startswith('average rate: ')
    failed = ros2(graph, 'topic', 'echo', '/point', '--filter', 'm.w')
    problem = "--filter 'm.w': AttributeError: 'Point' object has no attribute 'w'\n"
    assert failed == (1, '', problem)
    status, _, error = ros2(graph, 'topic', 'hz', '/point', '--filter', 'm.')
    assert status == 2
    assert "argument --filter: 'm.' is not an expression" in error


def test_flow_style_puts_lists_on_one_line(graph: dict[str, str], ros2: Words) -> None:
    shown = ros2(graph, 'topic', 'echo', '--once', '/array', '-l', '2', '--flow-style')
    expected = "layout:\n  dim: []\n  data_offset: 0\ndata: [0.0, 1.0, '...']\n---\n"
    assert shown == (0, expected, '')


def test_values_of_pub_come_from_standard_input(graph: dict[str, str], ros2: Words) -> None:
    arguments = ['topic', 'pub', '-1', '--stdin', '/in', 'std_msgs/msg/String']
    status, out, _ = ros2(graph, *arguments, stdin='data: from a file\n')
    assert status == 0
    assert "publishing #1: std_msgs.msg.String(data='from a file')" in out
    wrong = ros2(graph, *arguments, stdin='[1]')
    assert wrong == (1, '', 'The passed value needs to be a dictionary in YAML format\n')
    status, _, error = ros2(graph, *arguments, '{data: a}', stdin='data: b')
    assert status == 2
    assert 'not allowed with argument' in error


def test_parameters_are_described_loaded_and_deleted(
    graph: dict[str, str], ros2: Words, tmp_path: Path
) -> None:
    described = ros2(graph, 'param', 'describe', '/ns/talker', 'speed', 'loose', '--timeout', '9')
    expected = (
        'Parameter name: speed\n  Type: double\n  Constraints:\n'
        '    Min value: 0.0\n    Max value: 2.0\n'
        'Parameter name: loose\n  Type: integer\n  Description: may be deleted\n'
        '  Constraints:\n'
    )
    assert described == (0, expected, '')
    file = tmp_path / 'parameters.yaml'
    file.write_text(NODE_PARAMETERS.format(speed=0.5))
    loaded = 'Set parameter speed successful\nSet parameter loose successful\n'
    assert ros2(graph, 'param', 'load', 'ns/talker', str(file)) == (0, loaded, '')
    assert ros2(graph, 'param', 'get', '/ns/talker', 'loose')[1] == 'String value is: text\n'
    file.write_text(NODE_PARAMETERS.format(speed=7.5))
    status, out, error = ros2(graph, 'param', 'load', '/ns/talker', str(file))
    assert (status, out) == (1, 'Set parameter loose successful\n')
    assert error.startswith('Set parameter speed failed: Parameter speed out of range')
    assert error.count('\n') == 1
    deleted = ros2(graph, 'param', 'delete', '/ns/talker', 'loose')
    assert deleted == (0, 'Deleted parameter successfully\n', '')
    refused = (1, '', 'Deleting parameter failed: Static parameter cannot be undeclared\n')
    assert ros2(graph, 'param', 'delete', '/ns/talker', 'speed') == refused


@pytest.mark.parametrize(
    'text', ['', '[', 'a: b', '/ns/talker: {}', '/**: {ros__parameters: {a: 1}}']
)
def test_what_is_no_parameter_file_is_one_line(
    graph: dict[str, str], ros2: Words, tmp_path: Path, text: str
) -> None:
    file = tmp_path / 'parameters.yaml'
    file.write_text(text)

    status, out, error = ros2(graph, 'param', 'load', '/ns/talker', str(file))

    assert (status, out) == (1, '')
    assert error.startswith(f'{file}: ')
    assert error.count('\n') == 1


def test_time_out_of_an_absent_node(graph: dict[str, str], ros2: Words) -> None:
    absent = ('/nobody', 'speed', '--timeout', '0')
    for verb in ('get', 'describe', 'delete'):
        assert ros2(graph, 'param', verb, *absent) == (1, '', 'Node not found\n')
    status, _, error = ros2(graph, 'param', 'get', '/nobody', 'speed', '--timeout', '-1')
    assert status == 2
    assert 'value must be a non-negative integer' in error
