"""A replay that is driven from the keyboard of a real terminal."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
import os
from pathlib import Path
import pty
import subprocess
import sys

import pytest
from std_msgs.msg import String

from goalreach_bags.ros.player import ReplayTimer
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS
import graphs
from small_bags import string_topic, text_message, write_bag

APART_NS = 50_000_000
COUNT = 40
LIMIT_S = 90.0


@contextmanager
def replay_in_a_terminal(
    bag: Path, options: list[str], *, domain: int
) -> Iterator[tuple[subprocess.Popen[bytes], int]]:
    """Run `goalreach replay` with a pseudo-terminal as its keyboard; give it and the keys' end."""
    keys, terminal = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, '-m', 'goalreach_bringup.cli', 'replay', str(bag), '--quiet', *options],
        env=graphs.graph_environment(domain, bag),
        stdin=terminal,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(terminal)
    try:
        yield process, keys
    finally:
        process.terminate()
        process.wait(LIMIT_S)
        os.close(keys)


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    messages = [('/text', (k + 1) * APART_NS, text_message(f'{k:06d}')) for k in range(COUNT)]
    write_bag(tmp_path / 'bag', messages)
    return tmp_path / 'bag'


def has_come(messages: list[str], count: int) -> bool:
    return len(messages) >= count


@pytest.mark.graph
def test_steps_pause_and_end(bag: Path) -> None:
    domain = graphs.fresh_domain()
    came: list[str] = []
    with graphs.onlooker(domain) as (node, serve_until):
        node.create_subscription(String, '/text', lambda m: came.append(m.data), RELIABLE_QOS)
        with replay_in_a_terminal(bag, ['--paused', '--delay', '9'], domain=domain) as (run, keys):
            assert serve_until(lambda: node.count_publishers('/text') == 1, LIMIT_S)
            for steps, typed in ((1, b's'), (2, b'\x1b[C'), (5, b's\x1b[Cs')):
                os.write(keys, typed)
                assert serve_until(partial(has_come, came, steps), LIMIT_S), typed
                assert came == [f'{k:06d}' for k in range(steps)]
            os.write(keys, b' ')
            assert serve_until(lambda: len(came) >= 8, LIMIT_S)
            os.write(keys, b' ')
            serve_until(lambda: False, 1.0)
            stopped_at = len(came)
            serve_until(lambda: False, 5 * APART_NS * 1e-9)
            assert len(came) == stopped_at < COUNT
            os.write(keys, b'q')
            assert serve_until(lambda: run.poll() is not None, LIMIT_S)
            assert run.returncode == 0
            assert len(came) == stopped_at


@pytest.mark.graph
def test_faster(bag: Path) -> None:
    domain = graphs.fresh_domain()
    came: list[str] = []
    with graphs.onlooker(domain) as (node, serve_until):
        node.create_subscription(String, '/text', lambda m: came.append(m.data), RELIABLE_QOS)
        # At a thousandth of the speed the second message would come after 100 s.
        with replay_in_a_terminal(bag, ['--rate', '0.001', '--delay', '9'], domain=domain) as (
            run,
            keys,
        ):
            assert serve_until(lambda: len(came) == 1, LIMIT_S)
            os.write(keys, 32 * b'\x1b[A')
            assert serve_until(lambda: run.poll() is not None, LIMIT_S)
            assert run.returncode == 0
        assert serve_until(lambda: len(came) == COUNT, LIMIT_S)


@pytest.mark.graph
def test_what_cannot_be_published_costs_its_topic_alone(tmp_path: Path) -> None:
    unknown = string_topic('/split', type_name='my_msgs/msg/Split', type_hash='')
    long = '/' + 300 * 'a'
    topics = [string_topic(), unknown, string_topic('no topic'), string_topic(long)]
    messages = [(topic.name, k + 1, text_message('a')) for k in range(3) for topic in topics]
    write_bag(tmp_path / 'bag', messages, topics=topics)
    arguments = ['replay', str(tmp_path / 'bag'), '--quiet']

    with graphs.goalreach(arguments, domain=graphs.fresh_domain(), home=tmp_path) as player:
        text = player.communicate(timeout=LIMIT_S)[0]

    assert player.returncode == 0
    assert '/split is not replayed: ' in text
    assert 'no topic is not replayed: Invalid topic name: ' in text
    assert f'{long} is not replayed: Invalid topic name: ' in text
    assert 'replayed 3 messages' in text


def test_timer_keeps_pauses_and_rates() -> None:
    timer = ReplayTimer(rate=2.0)
    timer.jump(10.0, 1_000_000_000)
    assert timer.due_s(3_000_000_000) == 11.0
    timer.toggle(10.5)
    assert timer.time_ns(99.0) == 2_000_000_000
    timer.toggle(20.0)
    assert timer.due_s(3_000_000_000) == 20.5
    timer.change_rate(20.0, 0.5)
    assert timer.due_s(3_000_000_000) == 21.0
    timer.jump(30.0, 5_000_000_000)
    assert timer.time_ns(31.0) == 6_000_000_000
