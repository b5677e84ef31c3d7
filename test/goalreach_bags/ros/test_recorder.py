"""The recorder in this process, over real DDS."""

from pathlib import Path
import time

import pytest
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from goalreach_bags.options import RecordOptions
from goalreach_bags.reader import BagReader
from goalreach_bags.recording import CLOCK_KEY
from goalreach_bags.ros import recorder
from goalreach_msgs_py.ros.node import ros_session
import graphs

LIMIT_S = 30.0


def test_a_clock_that_never_comes_does_not_hold_messages_back(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A paused simulator of somebody else advertises its clock, and a camera is beside it."""
    domain = graphs.fresh_domain()
    for name, value in graphs.graph_environment(domain, tmp_path).items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(recorder, '_CLOCK_S', 0.3)
    written: list[str] = []
    end_s = time.monotonic() + LIMIT_S
    with graphs.onlooker(domain) as (node, _), ros_session() as closing:
        node.create_publisher(Clock, '/clock', 1)
        camera = node.create_publisher(String, '/text', 10)
        one = recorder.Recorder(RecordOptions(bag=tmp_path / 'bag'))
        closing.callback(one.destroy_node)

        def is_over() -> bool:
            camera.publish(String(data='image'))
            return bool(written) or time.monotonic() > end_s

        def watch(line: str) -> None:
            written.extend([line] * (not line.startswith('0 messages')))

        one.record(is_over, watch)
    assert written
    with BagReader(tmp_path / 'bag') as bag:
        assert bag.counts['/text'] > 0
        assert bag.metadata.custom[CLOCK_KEY] == 'wall'
