"""Processes of a graph: how they are started, when they are restarted, and when that ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import logging
from pathlib import Path
import signal
import time
from typing import Any

import pytest

from goalreach_bringup.launch import child_process, graph
from goalreach_bringup.launch.graph import Backoff, Graph, NodeDiedError, remap_arguments
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, LOCALIZER, NODES, ROBOT

PROGRAM = """
import signal, sys, time
from pathlib import Path
import yaml

def main():
    words = sys.argv[1:]
    values = yaml.safe_load(Path(words[-1]).read_text())
    print(*words[:-1], Path(words[-1]).name)
    print(sorted(values), flush=True)
    given = next(iter(values.values()))['ros__parameters']
    if given['status']:
        return given['status']
    if given['status'] is False:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    print('ready', flush=True)
    time.sleep(60)
"""

Make = Callable[..., Graph]


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Make]:
    """Give a function that makes a graph whose nodes end with the status in their parameters."""
    (tmp_path / 'program_of_nodes.py').write_text(PROGRAM, encoding='utf-8')
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(graph, 'NODES_MODULE', 'program_of_nodes')
    monkeypatch.setattr(graph, 'remove_abandoned', lambda: None)  # of this machine
    monkeypatch.setattr(child_process, '_GRACE_S', 0.3)
    monkeypatch.setattr(child_process, '_KILL_S', 0.3)
    made: list[Graph] = []

    def of_nodes(*nodes: str, composed: bool = False, status: object = 0) -> Graph:
        made.append(
            Graph(
                parameters={node: {'status': status} for node in NODES},
                directory=tmp_path,
                composed=composed,
                remaps=('/a:=/b', 'c:=d'),
                namespace='robot1',
                nodes=nodes,
            )
        )
        return made[-1]

    yield of_nodes
    for each in made:
        each.stop()


def no_changes() -> dict[str, dict[str, Any]]:
    return {}


def awake(_: float) -> bool:
    return False


def wait_for(path: Path, text: str) -> list[str]:
    """Wait for a line in a log; return its lines."""
    deadline_s = time.monotonic() + 20.0
    while text not in (lines := path.read_text().splitlines() if path.exists() else []):
        assert time.monotonic() < deadline_s, lines
        time.sleep(0.01)
    return lines


def wait_for_end(of: Graph, name: str) -> None:
    assert of._processes[name].wait(20.0)


def test_waits_not_at_all_then_twice_as_long_each_time_and_gives_up() -> None:
    backoff = Backoff(first_delay_s=0.5, limit=4, window_s=60.0)
    assert [backoff.died(t) for t in (1.0, 2.0, 3.0, 4.0)] == [0.0, 0.5, 1.0, None]


def test_old_deaths_are_forgiven() -> None:
    backoff = Backoff(first_delay_s=0.5, limit=3, window_s=10.0)
    assert [backoff.died(t) for t in (0.0, 5.0, 11.0, 30.0)] == [0.0, 0.5, 0.5, 0.0]


def test_a_process_may_die_four_times_in_a_minute() -> None:
    backoff = Backoff()
    assert [backoff.died(t) for t in (0.0, 1.0, 2.0, 3.0, 59.5)] == [0.0, 0.2, 0.4, 0.8, None]
    assert Backoff(_deaths_s=[0.0]).died(60.0) == 0.0


def test_rules_are_arguments_of_ros() -> None:
    assert remap_arguments(()) == ['--ros-args']
    assert remap_arguments(['a:=b', 'c:=d']) == [
        *('--ros-args', '--remap', 'a:=b', '--remap', 'c:=d')
    ]


def test_each_node_has_a_process_or_all_share_one(make: Make) -> None:
    assert make(ROBOT, ESTIMATOR).processes == {ROBOT: (ROBOT,), ESTIMATOR: (ESTIMATOR,)}
    assert make(ROBOT, ESTIMATOR, composed=True).processes == {'composed': (ROBOT, ESTIMATOR)}
    assert make(composed=True).processes == {}


def test_a_process_is_told_its_nodes_rules_and_parameters(make: Make, tmp_path: Path) -> None:
    both = make(ROBOT, LOCALIZER, composed=True)
    assert both.started_s == 0.0
    before_s = time.monotonic()
    both.start()
    assert both.started_s >= before_s
    arguments, nodes, _ = wait_for(tmp_path / 'composed.log', 'ready')
    rules = '--ros-args --remap /a:=/b --remap c:=d'
    assert arguments == f'{ROBOT} {LOCALIZER} {rules} --params-file composed.yaml'
    assert nodes == f"['/robot1/{LOCALIZER}', '/robot1/{ROBOT}']"


def test_a_process_that_dies_goes_on_later_and_later(
    make: Make, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    one = make(CONTROLLER, ESTIMATOR)
    one.start()
    for now_s, delay_s, when in ((10.0, 0.0, 'at once'), (20.0, 0.2, 'in 0.2 s')):
        wait_for(tmp_path / f'{CONTROLLER}.log', 'ready')
        assert not one.supervise(CONTROLLER, now_s, awake, no_changes)
        assert not one.is_down(CONTROLLER)
        one._processes[CONTROLLER].signal(signal.SIGKILL)
        wait_for_end(one, CONTROLLER)
        assert not one.supervise(CONTROLLER, now_s, awake, no_changes)
        assert (one.is_down(CONTROLLER), one.is_down(ESTIMATOR)) == (True, False)
        line = f'{CONTROLLER}: error: was ended by SIGKILL; restarting it {when}'
        assert caplog.messages[-1] == line
        (tmp_path / f'{CONTROLLER}.log').write_text('')
        again_s = now_s + delay_s
        assert not one.supervise(CONTROLLER, again_s - 0.1, awake, no_changes)
        assert one.supervise(CONTROLLER, again_s, awake, lambda: {CONTROLLER: {'first_path': 7}})
        assert not one.is_down(CONTROLLER)
    arguments, nodes, _ = wait_for(tmp_path / f'{CONTROLLER}.log', 'ready')
    assert arguments.endswith(f'{CONTROLLER}.yaml')
    assert nodes == f"['/robot1/{CONTROLLER}']"
    restarted = (tmp_path / f'{CONTROLLER}.yaml').read_text()
    assert 'first_path: 7' in restarted
    assert 'status: 0' in restarted


def test_a_process_that_does_not_answer_is_ended(
    make: Make, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    one = make(ROBOT, status=False)
    one.start()
    wait_for(tmp_path / f'{ROBOT}.log', 'ready')
    assert not one.supervise(ROBOT, 10.0, lambda now_s: now_s == 10.0, no_changes)
    assert one._processes[ROBOT].exit_status == -signal.SIGKILL
    line = f'{ROBOT}: error: did not answer in time and was ended; restarting it at once'
    assert caplog.messages == [line]
    one.restart({ROBOT: {'speed': 3.0}})
    assert not one.is_down(ROBOT)
    assert 'speed: 3.0' in (tmp_path / f'{ROBOT}.yaml').read_text()


def test_a_process_that_keeps_dying_or_was_refused_ends_the_run(
    make: Make, tmp_path: Path
) -> None:
    dying = make(ROBOT, status=3)
    dying.start()
    for _ in range(4):
        wait_for_end(dying, ROBOT)
        assert not dying.supervise(ROBOT, 10.0, awake, no_changes)
        assert dying.supervise(ROBOT, 12.0, awake, no_changes)
    wait_for_end(dying, ROBOT)
    keeps = (
        rf'{ROBOT}: error: ended with status 3: .*; it keeps dying \(log: {tmp_path}/{ROBOT}.log\)'
    )
    with pytest.raises(NodeDiedError, match=keeps) as died:
        dying.supervise(ROBOT, 14.0, awake, no_changes)
    assert died.value.status == 1

    refused = make(LOCALIZER, status=2)
    refused.start()
    wait_for_end(refused, LOCALIZER)
    with pytest.raises(NodeDiedError, match=r'^\['):  # its last line
        refused.supervise(LOCALIZER, 10.0, awake, no_changes)


def test_at_the_end_all_are_ended_and_who_had_to_be_killed_is_named(
    make: Make, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.ERROR)
    stubborn = make(ROBOT, status=False)
    stubborn.start()
    wait_for(tmp_path / f'{ROBOT}.log', 'ready')
    process = stubborn._processes[ROBOT]
    stubborn.stop()
    assert process.exit_status == -signal.SIGKILL
    assert caplog.messages == [f'{ROBOT}: error: did not end by itself and was killed']
