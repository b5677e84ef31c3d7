"""What a node shows to those who look on, over real DDS, at instants that the test sets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from std_msgs.msg import Header, UInt8MultiArray

from goalreach_msgs_py.ros import throttled as ros_glimpse
from goalreach_msgs_py.ros.raw_camera import image_to_raw
from goalreach_msgs_py.ros.raw_robot import clock_to_raw
from goalreach_msgs_py.ros.stamped_reply import Outbox
from goalreach_msgs_py.ros.subscribe_raw import RELIABLE_QOS, SENSOR_QOS
from goalreach_msgs_py.ros.throttled import (
    GLIMPSES_PER_S,
    Glimpse,
    Glimpsed,
    glimpse_from_raw,
    next_look_s,
)
from graphs import fresh_domain

LIMIT_TURNS = 400
EVERY = 3
"""Messages that a glimpse of the test's node holds of `/every`."""


@dataclass
class Speaker:
    """A node that answers stamps, and somebody who may look on.

    Attributes:
        node: Both of them.
        executor: Serves it.
        instants: Periods between glimpses that have gone by.
        glimpses: What was seen, glimpse by glimpse.
        pictures: Images seen.
    """

    node: Node
    executor: SingleThreadedExecutor
    instants: list[int]
    glimpses: list[list[Glimpsed]] = field(default_factory=list)
    pictures: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        glimpse = Glimpse(self.node, history={'/every': EVERY}, picture='/image')
        self._outbox = Outbox(glimpse)
        make = self.node.create_publisher
        self._every = make(Clock, '/every', RELIABLE_QOS)
        self._last = make(Clock, '/last', RELIABLE_QOS)
        self._image = make(Image, '/image', RELIABLE_QOS)
        self._rare = make(Header, '/rare', RELIABLE_QOS)

    def answer(self, stamp_ns: int) -> None:
        self._outbox.open(stamp_ns)
        for publisher in (self._every, self._last):
            self._outbox.send(publisher, clock_to_raw(stamp_ns))
        self._outbox.send(self._image, picture(stamp_ns))
        self._outbox.send(self._rare, Header())
        self._outbox.close()

    def repeat(self, stamp_ns: int) -> None:
        assert not self._outbox.open(stamp_ns)

    def answer_in_the_next_instant(self, stamp_ns: int) -> None:
        self.instants[0] += 1
        self.answer(stamp_ns)

    def watch(self, *, pictures: bool = False) -> None:
        """Look on, and answer the stamp 0 so that the node sees it."""

        def see(raw: bytes) -> None:
            self.glimpses.append(glimpse_from_raw(raw))

        name = '/_glimpse/speaker'
        self.node.create_subscription(UInt8MultiArray, name, see, SENSOR_QOS, raw=True)
        if pictures:
            keep = self.pictures.append
            topic = f'{name}/image'
            self.node.create_subscription(Image, topic, keep, SENSOR_QOS, raw=True)
        self.turn_until(lambda: self.node.count_subscribers(name) == 1)
        self.answer_in_the_next_instant(0)

    def turn_until(self, condition: Callable[[], bool]) -> None:
        for _ in range(LIMIT_TURNS):
            if condition():
                return
            self.executor.spin_once(timeout_sec=0.05)
        raise AssertionError(self.glimpses)


def picture(stamp_ns: int) -> bytes:
    return image_to_raw(np.zeros((2, 2), np.uint8), stamp_ns)


@pytest.fixture
def speaker(monkeypatch: pytest.MonkeyPatch) -> Iterator[Speaker]:
    instants = [0]
    wall = SimpleNamespace(monotonic=lambda: (instants[0] + 0.5) / GLIMPSES_PER_S)
    monkeypatch.setattr(ros_glimpse, 'time', wall)
    context = Context()
    rclpy.init(args=[], context=context, domain_id=fresh_domain())
    node = Node('speaker', context=context, enable_rosout=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        yield Speaker(node, executor, instants)
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()


def test_it_holds_the_bytes_last_sent_and_counts_them(speaker: Speaker) -> None:
    speaker.watch()
    for stamp_ns in (1, 2):
        speaker.answer(stamp_ns)
    assert speaker.glimpses == []
    speaker.answer_in_the_next_instant(3)
    speaker.answer_in_the_next_instant(4)
    speaker.turn_until(lambda: len(speaker.glimpses) == 2)
    assert speaker.glimpses == [
        [
            *(('/every', number, clock_to_raw(number)) for number in (1, 2, 3)),
            ('/last', 3, clock_to_raw(3)),
            ('/image', 3, b''),
        ],
        [('/every', 4, clock_to_raw(4)), ('/last', 4, clock_to_raw(4)), ('/image', 4, b'')],
    ]


def test_of_many_messages_it_holds_the_last(speaker: Speaker) -> None:
    speaker.watch()
    for stamp_ns in range(1, 10):
        speaker.answer(stamp_ns)
    speaker.answer_in_the_next_instant(10)
    speaker.turn_until(lambda: len(speaker.glimpses) == 1)
    numbers = [number for topic, number, _ in speaker.glimpses[0] if topic == '/every']
    assert numbers == [8, 9, 10]


def test_an_answer_that_is_repeated_counts_once(speaker: Speaker) -> None:
    speaker.watch()
    speaker.answer(1)
    speaker.repeat(1)
    speaker.answer_in_the_next_instant(2)
    speaker.turn_until(lambda: len(speaker.glimpses) == 1)
    assert ('/last', 2, clock_to_raw(2)) in speaker.glimpses[0]


def test_what_is_left_is_shown_when_no_more_is_said(speaker: Speaker) -> None:
    speaker.watch(pictures=True)
    speaker.answer(1)
    speaker.instants[0] = 3
    speaker.turn_until(lambda: len(speaker.glimpses) == 1)
    assert ('/last', 1, clock_to_raw(1)) in speaker.glimpses[0]
    speaker.instants[0] = 4
    speaker.turn_until(lambda: len(speaker.pictures) == 1)
    assert len(speaker.glimpses) == 1, 'nothing new was said'


def test_pictures_come_half_as_often_and_where_they_are_wanted(speaker: Speaker) -> None:
    speaker.watch(pictures=True)
    for stamp_ns in range(1, 9):
        speaker.answer_in_the_next_instant(stamp_ns)
        speaker.turn_until(lambda: len(speaker.glimpses) == stamp_ns)  # noqa: B023 - called now
    speaker.turn_until(lambda: len(speaker.pictures) == 4)
    assert speaker.pictures == [picture(stamp_ns) for stamp_ns in (1, 3, 5, 7)]


def test_nothing_is_kept_or_shown_while_nobody_looks(speaker: Speaker) -> None:
    for stamp_ns in range(1, 9):
        speaker.answer_in_the_next_instant(stamp_ns)
    speaker.watch()
    speaker.answer_in_the_next_instant(9)
    speaker.turn_until(lambda: len(speaker.glimpses) == 1)
    assert [number for _, number, _ in speaker.glimpses[0]] == [1, 1, 1]


def test_counting_begins_anew_when_all_have_gone(speaker: Speaker) -> None:
    speaker.watch()
    speaker.answer_in_the_next_instant(1)
    speaker.turn_until(lambda: len(speaker.glimpses) == 1)
    (subscription,) = speaker.node.subscriptions
    speaker.node.destroy_subscription(subscription)
    speaker.turn_until(lambda: speaker.node.count_subscribers('/_glimpse/speaker') == 0)
    for stamp_ns in (2, 3, 4):
        speaker.answer_in_the_next_instant(stamp_ns)
    speaker.watch()
    speaker.answer_in_the_next_instant(5)
    speaker.turn_until(lambda: len(speaker.glimpses) == 2)
    assert speaker.glimpses[1][0] == ('/every', 1, clock_to_raw(5))


def test_whoever_looks_when_told_finds_one_glimpse_each_time() -> None:
    looks = [next_look_s(0.0)]
    for _ in range(100):
        looks.append(next_look_s(looks[-1] + 0.003))
    instants = [int(look_s * GLIMPSES_PER_S) for look_s in looks]
    assert instants == list(range(101))
    late_s = [look_s - int(look_s * GLIMPSES_PER_S) / GLIMPSES_PER_S for look_s in looks]
    assert min(late_s) > 0.04  # in real time an answer comes so long after an instant at most
