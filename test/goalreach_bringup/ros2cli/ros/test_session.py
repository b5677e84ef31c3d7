"""The transports of `goalreach ros2`: a reader in a terminal can be stopped without harm."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
import signal

import pytest
from std_msgs.msg import String

from goalreach_msgs_py.ros.dds_profile import PROFILE_VARIABLE
import graphs


@pytest.mark.graph
@pytest.mark.parametrize('transports', [None, 'DEFAULT'])
def test_a_reader_has_shared_memory_only_where_asked(
    transports: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stopped reader without it keeps no writer busy; its place in the graph stays."""
    if transports:
        monkeypatch.setenv('FASTDDS_BUILTIN_TRANSPORTS', transports)
    domain = graphs.fresh_domain()
    words = ['ros2', 'topic', 'echo', '/word', 'std_msgs/msg/String']
    with ExitStack() as stack:
        node, serve_until = stack.enter_context(graphs.onlooker(domain))
        monkeypatch.delenv(PROFILE_VARIABLE, raising=False)  # the onlooker's
        reader = stack.enter_context(graphs.goalreach(words, domain=domain, home=tmp_path))
        publisher = node.create_publisher(String, '/word', 10)
        assert serve_until(lambda: publisher.get_subscription_count() == 1, 90.0)
        assert bool(graphs.shared_memory_of(reader.pid)) is bool(transports)
        publisher.publish(String(data='first'))
        assert reader.stdout is not None
        assert reader.stdout.readline() == 'data: first\n'
        reader.send_signal(signal.SIGSTOP)
        publisher.publish(String(data='second'))
        reader.send_signal(signal.SIGCONT)
        assert [reader.stdout.readline() for _ in range(2)] == ['---\n', 'data: second\n']
