"""The page's nodes and four that have parameters and nothing else, over real DDS."""

from __future__ import annotations

from collections.abc import Iterator
import threading
import time

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from goalreach_dashboard.ros.graph import GraphClient
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.topics import NODES
from graphs import fresh_domain, join

LIMIT_S = 90.0
FRAMES = 16
SLOW_FRAME_S = 0.3


@pytest.fixture
def graph(monkeypatch: pytest.MonkeyPatch) -> Iterator[GraphClient]:
    domain = fresh_domain()
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
    context = Context()
    join(domain, context)
    executor = SingleThreadedExecutor(context=context)
    nodes = [Node(name, context=context, enable_rosout=False) for name in NODES]
    for node in nodes:
        executor.add_node(node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    rclpy.init(args=[])
    graph = GraphClient(Arena())
    yield graph
    graph.close()
    rclpy.shutdown()
    executor.shutdown()
    thread.join()
    for node in nodes:
        node.destroy_node()
    context.try_shutdown()


def test_slow_frames_handle_every_response(
    graph: GraphClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four nodes respond between two frames, and each response is two events."""
    responses: list[str] = []
    restart = graph.state.restart

    def restart_and_count() -> None:
        restart()
        record = graph.state.health.record_response

        def count(node: str, now_s: float) -> None:
            responses.append(node)
            record(node, now_s)

        graph.state.health.record_response = count  # type: ignore[method-assign]

    monkeypatch.setattr(graph.state, 'restart', restart_and_count)
    deadline_s = time.monotonic() + LIMIT_S
    while set(responses) != set(NODES) and time.monotonic() < deadline_s:
        graph.update(watched=True)
        time.sleep(SLOW_FRAME_S)
    before = len(responses)
    for _ in range(FRAMES):
        graph.update(watched=True)
        time.sleep(SLOW_FRAME_S)
    assert len(responses) - before >= 3 * FRAMES
