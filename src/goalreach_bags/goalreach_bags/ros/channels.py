"""All topics that are being recorded, found in the graph as they appear."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from rclpy.duration import Duration, Infinite
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

from goalreach_bags.decode import begins_with_stamp
from goalreach_bags.options import TopicSelection
from goalreach_bags.tick_order import SequenceCount
from goalreach_bags.topic import INFINITE, BagTopic, message_definition
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.interfaces import message_class
from goalreach_msgs_py.topics import CLOCK

_REPLAY_DEPTH: Final = 10
"""Queue of a replayed topic whose depth the bag does not know, rosbag2's number. Of a latched
topic each publisher's last message is kept."""


def bag_topic(node: Node, name: str, type_name: str) -> BagTopic:
    """Return a topic of the graph as a bag keeps it.

    Raises:
        GoalreachError: The definition of its type is not installed.
    """
    publishers = node.get_publishers_info_by_topic(name)
    hashes = {str(p.topic_type_hash) for p in publishers if p.topic_type == type_name}
    return BagTopic(
        name=name,
        type_name=type_name,
        type_hash=min(hashes, default=''),
        offers=tuple(_offer(publisher.qos_profile) for publisher in publishers),
        definition=message_definition(type_name),
    )


def _offer(profile: QoSProfile) -> Qos:
    return Qos(
        history=QosHistory[profile.history.name],
        depth=profile.depth,
        reliability=QosReliability[profile.reliability.name],
        durability=QosDurability[profile.durability.name],
        deadline=_time(profile.deadline),
        lifespan=_time(profile.lifespan),
        liveliness=QosLiveliness[profile.liveliness.name],
        liveliness_lease_duration=_time(profile.liveliness_lease_duration),
        avoid_ros_namespace_conventions=False,
    )


def _time(duration: Any) -> QosTime:
    return INFINITE if duration == Infinite else QosTime(*divmod(duration.nanoseconds, 10**9))


def recording_profile(publishers: Iterable[Any], depth: int) -> QoSProfile:
    """Return the strictest profile that receives from all publishers of a topic.

    Args:
        publishers: Their endpoint information.
        depth: Messages that may wait for the recorder.
    """
    offered = [publisher.qos_profile for publisher in publishers]
    reliable = all(o.reliability is ReliabilityPolicy.RELIABLE for o in offered)
    latched = all(o.durability is DurabilityPolicy.TRANSIENT_LOCAL for o in offered)
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def publisher_profile(offers: Sequence[Qos]) -> QoSProfile:
    """Return the profile with which to publish a topic of a bag again.

    Where publishers differed, the strictest of reliability and durability, so that every
    subscriber that was served by one of them is served again.

    Args:
        offers: What the recorded publishers offered.
    """
    best_effort = {offer.reliability for offer in offers} == {QosReliability.BEST_EFFORT}
    latched = sum(offer.durability is QosDurability.TRANSIENT_LOCAL for offer in offers)
    depth = max((offer.depth for offer in offers), default=0) or latched or _REPLAY_DEPTH
    profile = QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        liveliness=LivelinessPolicy.AUTOMATIC,
    )
    deadlines = {offer.deadline for offer in offers}
    if len(deadlines) == 1 and INFINITE not in deadlines:
        deadline = deadlines.pop()
        profile.deadline = Duration(seconds=deadline.sec, nanoseconds=deadline.nsec)
    return profile


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


_COMPRESSED: Final = '/compressed'
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
            if not (self.records(name) or name == CLOCK) or self._is_copy(name):
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

    def _is_copy(self, name: str) -> bool:
        """Return whether a topic is the compressed copy of another and not selected by name.

        Its publisher may encode images only while somebody subscribes.
        """
        image = name.removesuffix(_COMPRESSED)
        if image == name or name in self._selection.full_names:
            return False
        return bool(self._node.count_publishers(image))

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
