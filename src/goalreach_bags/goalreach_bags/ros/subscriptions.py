"""Subscriptions of all topics that are being recorded, created as topics appear in the graph."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from goalreach_bags.decode import begins_with_stamp
from goalreach_bags.options import TopicSelection
from goalreach_bags.tick_order import SequenceCount
from goalreach_bags.topic import message_definition
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.interfaces import message_class
from goalreach_msgs_py.ros.messaging import RawReader, meet_all
from goalreach_msgs_py.topics import CLOCK

_COMPRESSED: Final = '/compressed'
_IMAGES: Final = ('sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage')
_DEPTH: Final = 1000
_IMAGE_DEPTH: Final = 100
"""Messages that may wait while the disk is slow: four seconds of images. Chosen."""


class TopicSubscription(RawReader):
    """Subscribes to a topic and takes its messages unparsed, with their publication numbers.

    Attributes:
        stamped: Whether its messages begin with a stamp.
        numbers: Counts messages published between others that were received, but not received.
    """

    def __init__(self, node: Node, name: str, type_name: str) -> None:
        kind, depth = message_class(type_name), _IMAGE_DEPTH if type_name in _IMAGES else _DEPTH
        profile = QoSProfile(depth=depth)
        meet_all(profile, node.get_publishers_info_by_topic(name))
        super().__init__(node, kind, name, profile)
        self.name, self.type_name = name, type_name
        self.stamped = begins_with_stamp(type_name, kind)
        self.numbers = SequenceCount()

    def take(self) -> Iterator[ReceivedMessage]:
        """Yield the messages that have arrived."""
        for data, info in self.received():
            if number := info['publication_sequence_number']:
                self.numbers.add(number, self.count_publishers())
            yield self, data, info


ReceivedMessage = tuple[TopicSubscription, bytes, Mapping[str, Any]]
"""A message with its subscription, serialized, and what rclpy says of it."""


class GraphSubscriptions:
    """Subscribes to the selected topics of the graph, and to the clock."""

    def __init__(self, node: Node, selection: TopicSelection, clock: str = CLOCK) -> None:
        self._node = node
        self._selection = selection
        self._clock = clock
        self.by_name: dict[str, TopicSubscription] = {}
        self.records = selection.includes
        self._refused: set[str] = set()
        self._expected: set[str] = set()

    def expect(self, types: Mapping[str, str]) -> None:
        """Subscribe to topics by their types, those to be recorded, before they are published."""
        for name in filter(self.records, types):
            self.by_name[name] = self._subscribe(name, [types[name]])
            self._expected.add(name)

    def discover(self) -> None:
        """Subscribe to new topics of the graph; warn once of those that cannot be recorded."""
        self._check_expected()
        for name, types in self._node.get_topic_names_and_types():
            if name in self.by_name or name in self._refused:
                continue
            wanted = name == self._clock or (self.records(name) and not self._is_copy(name))
            if wanted and self._node.count_publishers(name):
                try:
                    self.by_name[name] = self._subscribe(name, types)
                except GoalreachError as error:
                    self._refused.add(name)
                    self._node.get_logger().warning(f'{name} is not recorded: {error}')

    def _check_expected(self) -> None:
        """Drop subscriptions that receive nothing, because their publishers are others."""
        for name in filter(self._node.count_publishers, tuple(self._expected)):
            self._expected.remove(name)
            type_name = self.by_name[name].type_name
            publishers = self._node.get_publishers_info_by_topic(name)
            if not all(
                one.topic_type == type_name
                and one.qos_profile.reliability is ReliabilityPolicy.RELIABLE
                for one in publishers
            ):
                self.by_name.pop(name).close()

    def _is_copy(self, name: str) -> bool:
        """Return whether a topic is the compressed copy of another and not selected by name.

        Its publisher may encode images only while somebody subscribes.
        """
        image = name.removesuffix(_COMPRESSED)
        if image == name or name in self._selection.full_names:
            return False
        return bool(self._node.count_publishers(image))

    def _subscribe(self, name: str, types: Sequence[str]) -> TopicSubscription:
        if len(types) > 1:
            raise GoalreachError(f'has several types: {", ".join(types)}')
        message_definition(types[0])  # without which a bag cannot hold its messages
        return TopicSubscription(self._node, name, types[0])

    def take(self) -> Iterator[ReceivedMessage]:
        """Yield the messages that have arrived, those of the clock first."""
        for name in sorted(self.by_name, key=lambda name: name != self._clock):
            yield from self.by_name[name].take()

    def all_connected(self, names: Sequence[str]) -> bool:
        """Return whether topics are subscribed to, and all known publishers of each connected."""
        return all(
            name in self.by_name
            and self.by_name[name].count_publishers() >= max(1, self._node.count_publishers(name))
            for name in names
        )

    def lost(self) -> dict[str, int]:
        """Return the lost messages by recorded topic, where there are any."""
        recorded = filter(self.records, self.by_name)
        return {name: lost for name in recorded if (lost := self.by_name[name].numbers.lost)}
