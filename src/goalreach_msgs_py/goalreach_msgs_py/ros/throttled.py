"""What a node says, now and then, for those who only look on.

A page shows 20 pictures a second, and a run in lockstep sends a thousand of everything. To deliver
each message to another process costs the run a tenth of its time; a glimpse holds them all, and is
given only as often as somebody can look.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
import math
import struct
import time
from typing import Any, Final

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import Image
from std_msgs.msg import UInt8MultiArray

from goalreach_msgs_py.cdr import LITTLE_ENDIAN, pack_text
from goalreach_msgs_py.ros.common_messages import MessageError
from goalreach_msgs_py.ros.subscribe_raw import SENSOR_QOS
from goalreach_msgs_py.topics import glimpse_topic, picture_topic

Glimpsed = tuple[str, int, bytes]
"""Topic, number and bytes of a message."""

_COUNT = struct.Struct('<I')
_PAIR = struct.Struct('<2I')
_NO_OFFSET = 0
_NUMBERS = 1 << 32


def glimpse_to_raw(messages: Sequence[Glimpsed]) -> bytes:
    """Return messages in one."""
    parts = [LITTLE_ENDIAN, _COUNT.pack(len(messages))]
    labels: dict[str, bytes] = {}
    for topic, number, message in messages:
        label = labels.get(topic) or labels.setdefault(topic, pack_text(topic))
        parts += (label, _PAIR.pack(len(message), number % _NUMBERS))
    size = sum(len(message) for _, _, message in messages)
    parts.append(_PAIR.pack(_NO_OFFSET, size))
    parts += (message for _, _, message in messages)
    return b''.join(parts)


def glimpse_from_raw(raw: bytes) -> list[Glimpsed]:
    """Return the messages that one holds, as they were sent.

    Raises:
        MessageError: It is not as `glimpse_to_raw` makes it.
    """
    try:
        return _read(raw)
    except (ValueError, struct.error) as error:
        raise MessageError(f'not a glimpse: {error}') from None


def _read(raw: bytes) -> list[Glimpsed]:
    if not raw.startswith(LITTLE_ENDIAN):
        raise ValueError('another byte order')
    (count,) = _COUNT.unpack_from(raw, len(LITTLE_ENDIAN))
    at = len(LITTLE_ENDIAN) + _COUNT.size
    heads: list[tuple[str, int, int]] = []
    for _ in range(count):
        (length,) = _COUNT.unpack_from(raw, at)
        at += _COUNT.size
        topic = raw[at : at + length - 1].decode()
        at += (length + 3) // 4 * 4
        heads.append((topic, *_PAIR.unpack_from(raw, at)))
        at += _PAIR.size
    at += _PAIR.size
    if at + sum(size for _, size, _ in heads) > len(raw):
        raise ValueError('cut off')
    messages: list[Glimpsed] = []
    for topic, size, number in heads:
        messages.append((topic, number, raw[at : at + size]))
        at += size
    return messages


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
