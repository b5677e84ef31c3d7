"""One topic that is being recorded: its subscription, and how many messages were lost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from rclpy.node import Node

from goalreach_bringup.bags.losses import SequenceCount
from goalreach_bringup.bags.raw_message import begins_with_stamp
from goalreach_bringup.bags.ros_endpoints import recording_profile
from goalreach_bringup.ros2cli.interface_types import message_class

__all__ = ['Arrival', 'Channel']

_RELIABLE_DEPTH: Final = 1000
_SENSOR_DEPTH: Final = 100
"""Messages that may wait while the disk is slow: four seconds of images. Chosen."""


@dataclass(frozen=True, kw_only=True)
class Arrival:
    """A message as it was taken.

    Attributes:
        topic: Its topic.
        data: Serialized.
        received_ns: Wall clock when it arrived.
        published_ns: Wall clock of the publisher.
    """

    topic: str
    data: bytes
    received_ns: int
    published_ns: int


class Channel:
    """Subscribes a topic and takes its messages unparsed, with their numbers.

    Messages are taken by hand: rclpy's quick executor cannot hand their numbers on.

    Args:
        node: The recorder's node.
        name: The topic.
        type_name: Its type.

    Raises:
        GoalreachError: The type is not installed.
    """

    def __init__(self, node: Node, name: str, type_name: str) -> None:
        self.name = name
        self.type_name = type_name
        self._class = message_class(type_name)
        self.stamped = begins_with_stamp(type_name, self._class)
        self._node = node
        self._numbers = SequenceCount()
        self._publishers = 1
        publishers = node.get_publishers_info_by_topic(name)
        profile = recording_profile(publishers, _RELIABLE_DEPTH)
        if profile.reliability.short_key == 'best_effort':
            profile.depth = _SENSOR_DEPTH
        self._subscription: Any = node.create_subscription(
            self._class, name, _ignore, profile, raw=True
        )

    @property
    def lost(self) -> int:
        """Messages that were published between others that came, and did not come."""
        return self._numbers.lost

    @property
    def matched(self) -> bool:
        """Whether a publisher is connected."""
        return bool(self._subscription.get_publisher_count())

    def look(self) -> None:
        """Look how many publishers there are."""
        self._publishers = self._subscription.get_publisher_count()

    def take(self) -> Iterator[Arrival]:
        """Yield what has arrived."""
        while True:
            handle = self._subscription.handle
            with handle:
                taken = handle.take_message(self._class, True)
            if taken is None:
                return
            data, info = taken
            number = info['publication_sequence_number']
            if number:
                self._numbers.add(number, self._publishers)
            yield Arrival(
                topic=self.name,
                data=data,
                received_ns=info['received_timestamp'],
                published_ns=info['source_timestamp'],
            )


def _ignore(_message: Any) -> None:
    """Never called: messages are taken by hand."""
