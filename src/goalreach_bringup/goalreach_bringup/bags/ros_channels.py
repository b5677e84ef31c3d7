"""All topics that are being recorded, found in the graph as they appear."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from rclpy.node import Node

from goalreach_bringup.bags.ros_channel import Arrival, Channel
from goalreach_bringup.bags.ros_endpoints import bag_topic
from goalreach_bringup.bags.selection import TopicSelection
from goalreach_bringup.bags.topic import BagTopic
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.topics import CLOCK

__all__ = ['Channels']

_CLOCK_TYPE: Final = 'rosgraph_msgs/msg/Clock'


class Channels:
    """Subscribes what is selected; the clock comes first in every round.

    Args:
        node: The recorder's node.
        selection: Which topics to record.
    """

    def __init__(self, node: Node, selection: TopicSelection) -> None:
        self._node = node
        self._selection = selection
        self._channels: dict[str, Channel] = {}
        self._refused: set[str] = set()

    def discover(self) -> None:
        """Subscribe what is new in the graph; complain once of what cannot be recorded."""
        for name, types in self._node.get_topic_names_and_types():
            if name in self._channels or name in self._refused:
                continue
            if not (self._selection.includes(name) or name == CLOCK):
                continue
            if not self._node.count_publishers(name):
                continue
            try:
                self._channels[name] = self._subscribe(name, types)
            except GoalreachError as error:
                self._refused.add(name)
                self._node.get_logger().warning(f'{name} is not recorded: {error}')
        for channel in self._channels.values():
            channel.look()

    def _subscribe(self, name: str, types: Sequence[str]) -> Channel:
        if len(types) > 1:
            raise GoalreachError(f'has several types: {", ".join(types)}')
        bag_topic(self._node, name, types[0])
        return Channel(self._node, name, types[0])

    def take(self) -> Iterator[Arrival]:
        """Yield what has arrived."""
        clock = self._channels.get(CLOCK)
        if clock is not None:
            yield from clock.take()
        for channel in list(self._channels.values()):
            if channel is not clock:
                yield from channel.take()

    def records(self, name: str) -> bool:
        """Return whether a topic is to be recorded, not only listened to."""
        return self._selection.includes(name)

    def is_stamped(self, name: str) -> bool:
        """Return whether the topic's messages begin with a stamp."""
        return self._channels[name].stamped

    def type_of(self, name: str) -> str:
        """Return the type of a topic."""
        return self._channels[name].type_name

    def has_clock(self) -> bool:
        """Return whether the graph has a clock of its own."""
        return CLOCK in self._channels

    def missing(self, names: tuple[str, ...]) -> list[str]:
        """Return those names that are not connected to a publisher yet."""
        return [n for n in names if n not in self._channels or not self._channels[n].matched]

    def describe(self, name: str) -> BagTopic:
        """Return a topic as the bag keeps it."""
        return bag_topic(self._node, name, self._channels[name].type_name)

    def names(self) -> list[str]:
        """Return the names of the topics being recorded."""
        return [name for name in self._channels if self.records(name)]

    def lost(self) -> dict[str, int]:
        """Return the lost messages by topic, where there are any."""
        return {
            name: channel.lost
            for name, channel in self._channels.items()
            if channel.lost and self.records(name)
        }
