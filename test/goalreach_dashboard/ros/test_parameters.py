"""How often the page polls nodes, over real DDS, at times that the test sets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
import time

import pytest
from rcl_interfaces.srv import GetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from goalreach_dashboard.ros.graph import ParameterPoller
from goalreach_dashboard.state import PageState
from goalreach_msgs_py.arena import Arena
from graphs import fresh_domain, join

FRAME_S = 0.05
SECONDS = 4


@dataclass
class PolledRobot:
    """A robot whose parameters are polled.

    Attributes:
        poller: The poller.
        executor: Serves both nodes.
        calls: Number of calls received.
    """

    poller: ParameterPoller
    executor: SingleThreadedExecutor
    calls: int = 0

    def on_call(
        self, _request: GetParameters.Request, response: GetParameters.Response
    ) -> GetParameters.Response:
        self.calls += 1
        return response


@pytest.fixture
def robot() -> Iterator[PolledRobot]:
    context = Context()
    join(fresh_domain(), context)
    nodes = [
        Node(name, context=context, enable_rosout=False, start_parameter_services=False)
        for name in ('nomad200', 'dashboard_client')
    ]
    executor = SingleThreadedExecutor(context=context)
    for node in nodes:
        executor.add_node(node)
    robot = PolledRobot(ParameterPoller(nodes[1], PageState(arena=Arena())), executor)
    nodes[0].create_service(GetParameters, '/nomad200/get_parameters', robot.on_call)
    while not robot.calls:
        robot.poller.poll(time.monotonic())
        executor.spin_once(timeout_sec=0.1)
    try:
        yield robot
    finally:
        executor.shutdown()
        for node in nodes:
            node.destroy_node()
        context.try_shutdown()


def test_a_node_is_polled_four_times_a_second(robot: PolledRobot) -> None:
    before, began_s = robot.calls, time.monotonic()
    for frame in range(round(SECONDS / FRAME_S)):
        robot.poller.poll(began_s + frame * FRAME_S)
        while robot.poller._pending:
            robot.executor.spin_once(timeout_sec=0.1)
    assert 2.5 <= (robot.calls - before) / SECONDS <= 4.0
