"""Two robots in one domain, in lockstep, in one bag: each drives as if it were alone.

`GOALREACH_PATHS=10 pytest test/goalreach_bringup/launch/test_two_robots.py` drives more paths.
"""

from __future__ import annotations

from collections import Counter, defaultdict
import json
import os
from pathlib import Path
import subprocess

import pytest
from rclpy.node import Node

from goalreach_bags.reader import BagReader
import graphs

pytestmark = pytest.mark.graph
SEEDS = {'robot1': 1, 'robot2': 2}
PATHS = os.environ.get('GOALREACH_PATHS', '1')
LAST = '/cmd_vel'
"""The command that answers the last tick is published while the run ends, recorded or not."""


def run_words(robot: str, home: Path, *more: str) -> list[str]:
    words = ['run', '--quiet', '--no-dashboard', '--clock', 'lockstep', '--paths', PATHS]
    summary = str(home / f'{robot}.json')
    words += ['--namespace', robot, '--seed', str(SEEDS[robot]), '--summary', summary]
    return [*words, *more]


def assert_undisturbed(run: subprocess.Popen[str]) -> None:
    """Wait for the end of a run in which no process was replaced, as on an overloaded machine."""
    said, _ = run.communicate(timeout=600.0)
    assert run.returncode == 0, said
    assert 'restarting' not in said


def messages(path: Path, robot: str) -> dict[str, list[bytes]]:
    """Return the messages of a robot's topics in a bag."""
    found: dict[str, list[bytes]] = defaultdict(list)
    with BagReader(path) as bag:
        for message in bag.messages(
            [name for name in bag.topics if name.startswith(f'/{robot}/')]
        ):
            if not message.topic.endswith('/clock'):
                found[message.topic].append(bytes(message.data))
    return found


@pytest.mark.timeout(900)
def test_each_of_two_robots_drives_as_if_it_were_alone(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    for robot in SEEDS:
        words = run_words(robot, tmp_path, '--record', str(tmp_path / robot))
        with graphs.goalreach(words, domain=domain, home=tmp_path) as run:
            assert_undisturbed(run)
    parameters = tmp_path / 'parameters.yaml'
    parameters.write_text('/**/nomad200:\n  ros__parameters:\n    consumers: recorder\n')
    both = tmp_path / 'both'
    robots = [word for robot in SEEDS for word in ('--robot', robot)]
    first, second = (run_words(r, tmp_path, '--params-file', str(parameters)) for r in SEEDS)
    with graphs.goalreach(
        ['record', str(both), *robots], domain=domain, home=tmp_path
    ) as recorder:
        with (
            graphs.goalreach(first, domain=domain, home=tmp_path) as one,
            graphs.goalreach(second, domain=domain, home=tmp_path) as other,
        ):
            assert_undisturbed(one)
            assert_undisturbed(other)
        recorder.terminate()
        assert recorder.wait(30.0) == 0
    for robot in SEEDS:
        assert json.loads((tmp_path / f'{robot}.json').read_text())['success_rate'] == 1.0
        alone, beside = messages(tmp_path / robot, robot), messages(both, robot)
        assert set(alone) == set(beside)
        assert len(alone) > 12
        for topic, recorded in alone.items():
            count = len(recorded) - topic.endswith(LAST)
            assert beside[topic][:count] == recorded[:count], topic
        frame = b'\0%s/camera_optical_frame\0' % robot.encode()
        assert frame[1:] in beside[f'/{robot}/camera/image_raw'][0][:64]


def names_of(node: Node) -> Counter[str]:
    """Return how many nodes of each name and namespace a node sees."""
    found = node.get_node_names_and_namespaces()
    return Counter(f'{space.rstrip("/")}/{name}' for name, space in found)


def test_names_follow_the_namespace_and_one_namespace_has_one_run(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    words = ['run', '--namespace', '/robot1', '--no-dashboard', '--composed']
    with (
        graphs.onlooker(domain) as (node, serve_until),
        graphs.goalreach(words, domain=domain, home=tmp_path) as run,
    ):
        assert serve_until(lambda: names_of(node)['/robot1/run_monitor'] == 1, 90.0)
        assert serve_until(lambda: bool(node.count_publishers('/robot1/cmd_vel')), 90.0)
        topics = {name for name, _ in node.get_topic_names_and_types()}
        shared = {'/clock', '/parameter_events', '/rosout'}
        assert {name for name in topics if not name.startswith('/robot1/')} == shared
        assert '/robot1/nomad200/reset' in {n for n, _ in node.get_service_names_and_types()}
        with graphs.goalreach(words, domain=domain, home=tmp_path) as second:
            said, _ = second.communicate(timeout=30.0)
        assert second.returncode == 2
        assert 'another graph runs in /robot1' in said.splitlines()[-1]
        assert run.poll() is None


@pytest.mark.parametrize('name', ['robot-1', '1robot', 'a//b', 'a/'])
def test_a_bad_namespace_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    words = ['run', '--namespace', name]
    with graphs.goalreach(words, domain=graphs.fresh_domain(), home=tmp_path) as run:
        said, _ = run.communicate(timeout=30.0)
    assert run.returncode == 2
    assert (
        said
        == f"goalreach run: --namespace = '{name}': must be a ROS 2 namespace such as robot1\n"
    )
