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

from goalreach_msgs_py.ros.messaging import RELIABLE_QOS
import graphs
from small_bags import text_message, write_bag

pytestmark = pytest.mark.graph

APART_NS = 50_000_000
COUNT = 40
LIMIT_S = 20.0


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


def test_steps_pause_and_end(bag: Path) -> None:
    domain = graphs.fresh_domain()
    came: list[str] = []
    with graphs.onlooker(domain) as (node, serve_until):
        node.create_subscription(String, '/text', lambda m: came.append(m.data), RELIABLE_QOS)
        with replay_in_a_terminal(bag, ['--paused', '--delay', '2'], domain=domain) as (run, keys):
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


def test_faster(bag: Path) -> None:
    domain = graphs.fresh_domain()
    came: list[str] = []
    with graphs.onlooker(domain) as (node, serve_until):
        node.create_subscription(String, '/text', lambda m: came.append(m.data), RELIABLE_QOS)
        # At a thousandth of the speed the second message would come after 100 s.
        with replay_in_a_terminal(bag, ['--rate', '0.001', '--delay', '2'], domain=domain) as (
            run,
            keys,
        ):
            assert serve_until(lambda: len(came) == 1, LIMIT_S)
            os.write(keys, 32 * b'\x1b[A')
            assert serve_until(lambda: run.poll() is not None, LIMIT_S)
            assert run.returncode == 0
        assert serve_until(lambda: len(came) == COUNT, 1.0)
