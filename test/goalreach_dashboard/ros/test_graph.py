"""The page's nodes and four that have parameters and nothing else, over real DDS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import threading
import time

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from goalreach_dashboard.health import NodeStatus
from goalreach_dashboard.ros.graph import GraphClient
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.topics import NODES
from graphs import fresh_domain

LIMIT_S = 20.0
SLOW_FRAME_S = 0.3


@pytest.fixture
def graph(monkeypatch: pytest.MonkeyPatch) -> Iterator[GraphClient]:
    domain = fresh_domain()
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    executor = SingleThreadedExecutor(context=context)
    nodes = [Node(name, context=context, enable_rosout=False) for name in NODES]
    for node in nodes:
        executor.add_node(node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    graph = GraphClient(Arena())
    yield graph
    graph.close()
    executor.shutdown()
    thread.join()
    for node in nodes:
        node.destroy_node()
    context.try_shutdown()


def update_until(graph: GraphClient, condition: Callable[[], bool]) -> bool:
    deadline_s = time.monotonic() + LIMIT_S
    while not condition() and time.monotonic() < deadline_s:
        graph.update(watched=True)
        time.sleep(SLOW_FRAME_S)
    return condition()


def test_slow_frames_handle_every_response(graph: GraphClient) -> None:
    """Four nodes respond between two frames, and each response is two events."""

    def all_respond() -> bool:
        statuses = [graph.state.health.status(name, time.monotonic()) for name in NODES]
        return statuses == [NodeStatus.QUIET] * len(NODES)

    assert update_until(graph, all_respond)
    for _ in range(20):
        graph.update(watched=True)
        assert all_respond()
        time.sleep(SLOW_FRAME_S)
