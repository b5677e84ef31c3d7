"""What the graph tells of a topic's publishers, as a bag keeps it; and the way back."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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

from goalreach_bringup.bags.definitions_file import message_definition
from goalreach_bringup.bags.topic import INFINITE_NS, BagTopic, QosOffer

__all__ = ['bag_topic', 'publisher_profile', 'recording_profile']

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


def _offer(profile: QoSProfile) -> QosOffer:
    return QosOffer(
        history=profile.history.short_key,
        depth=profile.depth,
        reliability=profile.reliability.short_key,
        durability=profile.durability.short_key,
        liveliness=profile.liveliness.short_key,
        deadline_ns=_nanoseconds(profile.deadline),
        lifespan_ns=_nanoseconds(profile.lifespan),
        liveliness_lease_duration_ns=_nanoseconds(profile.liveliness_lease_duration),
    )


def _nanoseconds(duration: Any) -> int:
    return INFINITE_NS if duration == Infinite else int(duration.nanoseconds)


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


def publisher_profile(offers: Sequence[QosOffer]) -> QoSProfile:
    """Return the profile with which to publish a topic of a bag again.

    Where publishers differed, the strictest of reliability and durability, so that every
    subscriber that was served by one of them is served again.

    Args:
        offers: What the recorded publishers offered.
    """
    reliable = not offers or any(offer.reliability == 'reliable' for offer in offers)
    latched = sum(offer.durability == 'transient_local' for offer in offers)
    depth = max((offer.depth for offer in offers), default=0) or latched or _REPLAY_DEPTH
    profile = QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        liveliness=LivelinessPolicy.AUTOMATIC,
    )
    deadlines_ns = {offer.deadline_ns for offer in offers}
    if len(deadlines_ns) == 1 and INFINITE_NS not in deadlines_ns:
        profile.deadline = Duration(nanoseconds=deadlines_ns.pop())
    return profile
