"""Quality of service over real DDS: overrides by parameters, and profiles that do not fit."""

from __future__ import annotations

from collections.abc import Callable
import re

import pytest
import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, SENSOR_QOS, advertise, subscribe_raw
from graphs import fresh_domain


@pytest.fixture(name='make_node')
def _make_node() -> object:
    """Return a function that makes a node with given parameters, in a domain of the test's own."""
    nodes: list[Node] = []
    rclpy.init(args=[], domain_id=fresh_domain())

    def make(name: str, **parameters: object) -> Node:
        words = [word for key, value in parameters.items() for word in ('-p', f'{key}:={value}')]
        node = Node(name, namespace='/robot1', cli_args=['--ros-args', *words])
        nodes.append(node)
        return node

    yield make
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def spin_until(condition: Callable[[], bool], *nodes: Node) -> bool:
    """Serve nodes for at most 10 s until a condition holds; return whether it does."""
    executor = EventsExecutor()
    for node in nodes:
        executor.add_node(node)
    ends = rclpy.clock.Clock().now().nanoseconds + 10 * 10**9
    while not condition() and rclpy.clock.Clock().now().nanoseconds < ends:
        executor.spin_once(timeout_sec=0.05)
    executor.shutdown()
    return condition()


def test_names_are_relative_and_quality_of_service_can_be_overridden(
    make_node: Callable[..., Node],
) -> None:
    prefix = 'qos_overrides./robot1/camera.publisher'
    node = make_node('a', **{f'{prefix}.reliability': 'best_effort', f'{prefix}.depth': 3})
    publisher = advertise(node, Clock, '/camera', RELIABLE_QOS)
    subscribe_raw(node, Clock, '/clock', lambda *_: None, SENSOR_QOS)
    assert publisher.topic_name == '/robot1/camera'
    assert [s.topic_name for s in node.subscriptions] == ['/clock']
    (found,) = node.get_publishers_info_by_topic('/robot1/camera')
    assert found.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
    assert node.get_parameter(f'{prefix}.depth').value == 3
    assert RELIABLE_QOS.reliability is ReliabilityPolicy.RELIABLE, 'the constant was changed'


@pytest.mark.parametrize('value', ['certain', '7', '[1]'])
def test_a_bad_override_is_refused_with_its_topic(
    make_node: Callable[..., Node], value: str
) -> None:
    name = 'qos_overrides./robot1/camera.publisher.reliability'
    node = make_node('a', **{name: value})
    with pytest.raises(GoalreachError, match=r'^qos_overrides of /camera: .*reliability'):
        advertise(node, Clock, '/camera', RELIABLE_QOS)


def test_both_ends_name_the_topic_and_the_policy_that_does_not_fit(
    make_node: Callable[..., Node], capfd: pytest.CaptureFixture[str]
) -> None:
    writer, reader = make_node('writer'), make_node('reader')
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    advertise(writer, Clock, '/odom', best_effort)
    subscribe_raw(reader, Clock, '/odom', lambda *_: None, RELIABLE_QOS)
    said = ''

    def both_said() -> bool:
        nonlocal said
        said += capfd.readouterr().err
        return all(
            re.search(
                rf"\[robot1.{ours}\]: New {other} discovered on topic 'odom'.*RELIABILITY", said
            )
            for ours, other in (('writer', 'subscription'), ('reader', 'publisher'))
        )

    assert spin_until(both_said, writer, reader), said
