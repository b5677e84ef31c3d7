"""What a node says, now and then, for those who only look on.

A page shows 20 pictures a second, and a run in lockstep sends a thousand of everything. To deliver
each message to another process costs the run a tenth of its time; a glimpse holds them all, and is
given only as often as somebody can look.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
import math
import time
from typing import Any, Final

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import Image
from std_msgs.msg import UInt8MultiArray

from goalreach_msgs_py.ros_qos import SENSOR_QOS
from goalreach_msgs_py.ros_raw_glimpse import Glimpsed, glimpse_to_raw
from goalreach_msgs_py.topics import glimpse_topic, picture_topic

__all__ = ['GLIMPSES_PER_S', 'Glimpse', 'next_look_s']

GLIMPSES_PER_S: Final = 20
"""As often as pages show pictures: who looks on can look between the instants of `next_look_s`.
Chosen."""
_GLIMPSES_PER_PICTURE: Final = 2
_PERIODS_TO_SETTLE: Final = 5
"""A simulation that stands still ends no answer."""
_LOOK: Final = 0.96
"""When to look, in periods after an instant: all have spoken by then, in real time too, where an
answer comes every 40 ms, and none is at the next instant yet. Chosen."""


def next_look_s(now_s: float) -> float:
    """Return when to look at glimpses next, so that each look finds one.

    Args:
        now_s: Time of the monotonic clock, which all processes of a machine share.
    """
    return (math.floor(now_s * GLIMPSES_PER_S - _LOOK) + 1 + _LOOK) / GLIMPSES_PER_S


class _Said:
    """The messages of one publisher since the last glimpse.

    Args:
        publisher: Who sends them.
        most: How many messages are kept.
    """

    def __init__(self, publisher: Publisher[Any], most: int) -> None:
        """Begin to count."""
        self.publisher = publisher
        self.topic = publisher.topic_name
        self.number = 0
        self.messages: deque[bytes] = deque(maxlen=most)


class Glimpse:
    """Shows what a node said, at most 20 times a second of the wall clock.

    All nodes show the first answer after the same instants, so that what they show belongs
    together. While nobody subscribes nothing is kept, and whether somebody does is looked up as
    seldom. What is simulated and sent on other topics is the same with it and without.

    Args:
        node: The node.
        history: By topic, how many of its messages since the last glimpse are shown; where a topic
            is not named, its last.
        picture: Topic of images, which are counted here; every other glimpse, the last one is
            shown on a topic of its own.
    """

    def __init__(
        self, node: Node, *, history: Mapping[str, int] | None = None, picture: str | None = None
    ) -> None:
        """Make the publishers, which are the first of the node that others hear of."""
        name = node.get_fully_qualified_name()
        self._publisher = node.create_publisher(UInt8MultiArray, glimpse_topic(name), SENSOR_QOS)
        self._pictures: Publisher[Image] | None = None
        if picture is not None:
            self._pictures = node.create_publisher(Image, picture_topic(name), SENSOR_QOS)
        self._picture = picture
        self._history = dict(history or {})
        self._said: dict[Publisher[Any], _Said] = {}
        self._watched = False
        self._instant, self._pictured = 0, -_GLIMPSES_PER_PICTURE
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(_PERIODS_TO_SETTLE / GLIMPSES_PER_S, self._settle, clock=steady)

    def look(self, answer: Sequence[tuple[Publisher[Any], object]]) -> None:
        """Take what the node said to one stamp, all of it, and show it if it is time.

        Args:
            answer: Publishers and messages; only those in bytes count.
        """
        if self._watched:
            for publisher, message in answer:
                if isinstance(message, bytes):
                    said = self._said.get(publisher)
                    if said is None:
                        most = self._history.get(publisher.topic, 1)
                        said = self._said[publisher] = _Said(publisher, most)
                    said.number += 1
                    said.messages.append(message)
        instant = int(time.monotonic() * GLIMPSES_PER_S)
        if instant != self._instant:
            self._instant = instant
            self._show()

    def _settle(self) -> None:
        """Show what is left where nothing more is said, and see who looks on."""
        self.look(())

    def _show(self) -> None:
        if self._watched:
            shown = [each for said in self._said.values() for each in self._new(said)]
            if any(message for _, _, message in shown):
                self._publisher.publish(glimpse_to_raw(shown))
        self._watched = self._publisher.get_subscription_count() > 0
        if not self._watched:
            self._said.clear()

    def _new(self, said: _Said) -> list[Glimpsed]:
        """Return what was said since the last glimpse."""
        messages = said.messages
        if said.publisher.topic == self._picture:
            self._show_picture(messages)
            return [(said.topic, said.number, b'')]
        first = said.number - len(messages) + 1
        new = [(said.topic, number, raw) for number, raw in enumerate(messages, first)]
        messages.clear()
        return new

    def _show_picture(self, images: deque[bytes]) -> None:
        if self._pictures is None or self._instant - self._pictured < _GLIMPSES_PER_PICTURE:
            return
        if images and self._pictures.get_subscription_count():
            self._pictures.publish(images[-1])
            self._pictured = self._instant
        images.clear()
