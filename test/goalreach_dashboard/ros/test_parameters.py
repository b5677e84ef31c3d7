"""How often the page asks nodes, over real DDS, at times that the test sets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import itertools
import time

import pytest
from rcl_interfaces.srv import GetParameters
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from goalreach_dashboard.ros.parameters import Questions
from goalreach_dashboard.state import PageState
from goalreach_msgs_py import topics
from goalreach_msgs_py.arena import Arena
from graphs import fresh_domain

LOOK_S = 0.05
SECONDS = 4


@dataclass
class Asked:
    """A robot that is asked.

    Attributes:
        state: What the page knows of it.
        questions: Who asks.
        serve: Serves both.
        count: How many questions came.
    """

    state: PageState
    questions: Questions
    serve: Callable[[], None]
    count: int = 0

    def answer(
        self, _request: GetParameters.Request, response: GetParameters.Response
    ) -> GetParameters.Response:
        self.count += 1
        return response

    def questions_a_second(self, *, heard: bool) -> float:
        """Return how many come while the robot is heard, or not, each answered at once."""
        before, begun_s = self.count, time.monotonic()
        numbers = itertools.count(1)
        for look in range(round(SECONDS / LOOK_S)):
            now_s = begun_s + look * LOOK_S
            if heard:
                self.state.health.record_message(topics.CLOCK, now_s, next(numbers))
            self.questions.ask(now_s)
            while self.questions.waiting:
                self.serve()
        return (self.count - before) / SECONDS


@pytest.fixture
def asked() -> Iterator[Asked]:
    context = Context()
    rclpy.init(args=[], context=context, domain_id=fresh_domain())
    nodes = [
        Node(name, context=context, enable_rosout=False, start_parameter_services=False)
        for name in ('nomad200', 'dashboard_asks')
    ]
    executor = SingleThreadedExecutor(context=context)
    for node in nodes:
        executor.add_node(node)
    state = PageState(arena=Arena())
    asked = Asked(state, Questions(nodes[1], state), lambda: executor.spin_once(timeout_sec=0.1))
    nodes[0].create_service(GetParameters, '/nomad200/get_parameters', asked.answer)
    while not asked.count:
        asked.questions.ask(time.monotonic())
        asked.serve()
    try:
        yield asked
    finally:
        executor.shutdown()
        for node in nodes:
            node.destroy_node()
        context.try_shutdown()


def test_a_node_that_is_heard_is_asked_once_a_second(asked: Asked) -> None:
    assert asked.questions_a_second(heard=True) <= 1.25


def test_a_node_that_is_not_heard_is_asked_more_often(asked: Asked) -> None:
    assert asked.questions_a_second(heard=False) >= 2.5


def test_questions_hurry_when_something_is_changed(asked: Asked) -> None:
    asked.questions.hurry(time.monotonic())
    assert asked.questions_a_second(heard=True) > 2.0
