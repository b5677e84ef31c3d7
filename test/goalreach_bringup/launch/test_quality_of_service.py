"""Every topic of the contract, heard by both kinds of reader, and what our own readers ask for."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path
import re

import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.ros.interfaces import message_class
from goalreach_msgs_py.topics import NODES
import graphs

ROOT = Path(__file__).parents[3]
ROWS = re.findall(
    r'^\| `(/[\w/]+)`<br>(\w+/\w+) \| (.*) \|$',
    (ROOT / 'docs' / 'CONTRACT.md').read_text(),
    re.MULTILINE,
)
TYPES = {topic: kind for topic, kind, _ in ROWS}
LATCHED = {topic for topic, _, content in ROWS if 'transient local' in content}
SENSORS = {'/clock', '/camera/image_raw', '/camera/camera_info', '/odom', '/joint_states'}
SENSORS |= {'/bumpers'}
READERS = {
    'reliable': QoSProfile(depth=1000),
    'best effort': QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT),
    'transient local': QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL),
}
IMAGE = '/camera/image_raw'
PERIOD_NS = 40_000_000


def subscribe_to_all(node: Node) -> dict[tuple[str, str], list[int]]:
    """Subscribe to each topic with each profile; return the stamps heard, by profile and topic."""
    heard: dict[tuple[str, str], list[int]] = defaultdict(list)

    def hear(key: tuple[str, str], raw: bytes) -> None:
        heard[key].append(0 if key[1] in LATCHED else stamp_of(raw))

    for name, profile in READERS.items():
        for topic, kind in TYPES.items():
            node.create_subscription(
                message_class(kind), topic, partial(hear, (name, topic)), profile, raw=True
            )
    return heard


def check_ends(node: Node) -> None:
    """Check what our publishers offer, and what our subscribers ask for."""
    for topic in TYPES:
        for info in node.get_publishers_info_by_topic(topic):
            offered = info.qos_profile
            assert offered.reliability is ReliabilityPolicy.RELIABLE, topic
            latched = offered.durability is DurabilityPolicy.TRANSIENT_LOCAL
            assert latched == (topic in LATCHED), topic
        for info in node.get_subscriptions_info_by_topic(topic):
            if info.node_name in NODES:
                best_effort = info.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
                assert best_effort == (topic in SENSORS), (topic, info.node_name)


@pytest.mark.graph
def test_each_reader_hears_what_its_profile_allows(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    command = ['run', '--policy', 'paper', '--no-dashboard', '--composed', '--speed', '2']
    with (
        graphs.goalreach(command, domain=domain, home=tmp_path),
        graphs.onlooker(domain) as (node, serve_until),
    ):
        heard = subscribe_to_all(node)
        # A reader without history may have come after the only message of a latched topic.
        needed = {
            (name, t) for name in ('reliable', 'best effort') for t in TYPES.keys() - LATCHED
        }
        needed |= {('transient local', topic) for topic in LATCHED}
        complete: Callable[[], bool] = lambda: needed <= heard.keys()  # noqa: E731 - a type
        serve_until(lambda: complete() and len(heard['reliable', IMAGE]) > 100, 90.0)
        check_ends(node)
    assert len(TYPES) > 15
    assert len(LATCHED) == 2
    assert needed <= heard.keys()
    assert {topic for name, topic in heard if name == 'transient local'} == LATCHED
    images = heard['reliable', IMAGE]
    assert images == [images[0] + PERIOD_NS * k for k in range(len(images))]
