"""Subscriptions of all topics that are being recorded, created as topics appear in the graph."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy

from goalreach_bags.decode import begins_with_stamp
from goalreach_bags.options import TopicSelection
from goalreach_bags.ros.qos_profiles import bag_topic, recording_profile
from goalreach_bags.tick_order import SequenceCount
from goalreach_bags.topic import BagTopic
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.interfaces import message_class
from goalreach_msgs_py.topics import CLOCK

_COMPRESSED: Final = '/compressed'
_RELIABLE_DEPTH: Final = 1000
_SENSOR_DEPTH: Final = 100
"""Messages that may wait while the disk is slow: four seconds of images. Chosen."""


@dataclass(frozen=True, kw_only=True)
class ReceivedMessage:
    """A message as it was received.

    Attributes:
        topic: Its topic.
        type_name: `package/msg/Name`.
        stamped: Whether it begins with a stamp.
        data: The serialized message.
        received_ns: Wall clock when it arrived.
        published_ns: Wall clock of the publisher.
    """

    topic: str
    type_name: str
    stamped: bool
    data: bytes
    received_ns: int
    published_ns: int


class TopicSubscription:
    """Subscribes to a topic and takes its messages unparsed, with their publication numbers.

    Messages are taken by hand: rclpy's executors do not pass their numbers on.

    Args:
        node: The recorder's node.
        name: The topic.
        type_name: Its type.

    Raises:
        GoalreachError: The type is not installed.
    """

    def __init__(self, node: Node, name: str, type_name: str) -> None:
        self._name = name
        self.type_name = type_name
        self._class = message_class(type_name)
        self._stamped = begins_with_stamp(type_name, self._class)
        self._numbers = SequenceCount()
        self._publishers = 1
        profile = recording_profile(node.get_publishers_info_by_topic(name), _RELIABLE_DEPTH)
        if profile.reliability is ReliabilityPolicy.BEST_EFFORT:
            profile.depth = _SENSOR_DEPTH
        self._subscription: Any = node.create_subscription(
            self._class, name, lambda _message: None, profile, raw=True
        )

    @property
    def lost(self) -> int:
        """Messages published between others that were received, but not received."""
        return self._numbers.lost

    def count_publishers(self) -> int:
        """Return how many publishers are connected."""
        self._publishers = self._subscription.get_publisher_count()
        return self._publishers

    def take(self) -> Iterator[ReceivedMessage]:
        """Yield the messages that have arrived."""
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
            yield ReceivedMessage(
                topic=self._name,
                type_name=self.type_name,
                stamped=self._stamped,
                data=data,
                received_ns=info['received_timestamp'],
                published_ns=info['source_timestamp'],
            )


class GraphSubscriptions:
    """Subscribes to the selected topics of the graph, and to the clock.

    Args:
        node: The recorder's node.
        selection: Which topics to record.
    """

    def __init__(self, node: Node, selection: TopicSelection) -> None:
        self._node = node
        self._selection = selection
        self._subscriptions: dict[str, TopicSubscription] = {}
        self._refused: set[str] = set()

    def discover(self) -> None:
        """Subscribe to new topics of the graph; warn once of those that cannot be recorded."""
        for name, types in self._node.get_topic_names_and_types():
            if name in self._subscriptions or name in self._refused:
                continue
            wanted = name == CLOCK or (self.records(name) and not self._is_copy(name))
            if wanted and self._node.count_publishers(name):
                try:
                    self._subscriptions[name] = self._subscribe(name, types)
                except GoalreachError as error:
                    self._refused.add(name)
                    self._node.get_logger().warning(f'{name} is not recorded: {error}')
        for subscription in self._subscriptions.values():
            subscription.count_publishers()

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
        bag_topic(self._node, name, types[0])
        return TopicSubscription(self._node, name, types[0])

    def take(self) -> Iterator[ReceivedMessage]:
        """Yield the messages that have arrived, those of the clock first."""
        clock = self._subscriptions.get(CLOCK)
        if clock is not None:
            yield from clock.take()
        for subscription in list(self._subscriptions.values()):
            if subscription is not clock:
                yield from subscription.take()

    def records(self, name: str) -> bool:
        """Return whether a topic is to be recorded, not only received."""
        return self._selection.includes(name)

    def has_clock(self) -> bool:
        """Return whether the graph has a clock of its own."""
        return CLOCK in self._subscriptions

    def all_connected(self, names: Sequence[str]) -> bool:
        """Return whether topics are subscribed to and have a publisher connected."""
        found = [self._subscriptions.get(name) for name in names]
        return all(s is not None and s.count_publishers() for s in found)

    def describe(self, name: str) -> BagTopic:
        """Return the description of a topic for the bag."""
        return bag_topic(self._node, name, self._subscriptions[name].type_name)

    def names(self) -> list[str]:
        """Return the names of the topics being recorded."""
        return [name for name in self._subscriptions if self.records(name)]

    def lost(self) -> dict[str, int]:
        """Return the lost messages by topic, where there are any."""
        lost = {name: self._subscriptions[name].lost for name in self.names()}
        return {name: count for name, count in lost.items() if count}
