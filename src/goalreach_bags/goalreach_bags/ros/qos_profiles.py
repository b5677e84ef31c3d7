"""Quality of service of recorded and replayed topics: from the graph, to the bag and back."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from rclpy.duration import Duration, Infinite
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    InvalidQoSProfileException,
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

from goalreach_bags.topic import INFINITE, BagTopic, message_definition
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.files import read_yaml

_REPLAY_DEPTH: Final = 10
"""Queue of a replayed topic whose depth the bag does not know, rosbag2's number. Of a latched
topic each publisher's last message is kept."""


def bag_topic(node: Node, name: str, type_name: str) -> BagTopic:
    """Return the description of a topic of the graph for a bag.

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


_POLICIES: Final = {
    'history': HistoryPolicy,
    'reliability': ReliabilityPolicy,
    'durability': DurabilityPolicy,
    'liveliness': LivelinessPolicy,
}
_DURATIONS: Final = ('deadline', 'lifespan', 'liveliness_lease_duration')


def read_overrides(path: Path) -> dict[str, QoSProfile]:
    """Return the profiles by topic in a file in the format of `ros2 bag play`.

    Raises:
        FileFormatError: The file cannot be read, or a policy or value in it is not known.
    """
    document = read_yaml(path)
    if not isinstance(document, dict):
        raise FileFormatError(path, 'must be a mapping of topics to their policies')
    return {str(name): _override(path, name, values) for name, values in document.items()}


def _override(path: Path, topic: object, values: object) -> QoSProfile:
    if not isinstance(values, dict):
        raise FileFormatError(path, f'{topic} = {values!r}: must be a mapping of policies')
    settings = {str(key): _policy(path, f'{topic}.{key}', key, v) for key, v in values.items()}
    try:
        return QoSProfile(**settings)
    except InvalidQoSProfileException as error:
        raise FileFormatError(path, f'{topic}: {error.args[-1]}') from None


def _policy(path: Path, field: str, key: object, value: Any) -> object:
    """Return one policy as rclpy has it."""
    try:
        if key in _POLICIES:
            return _POLICIES[str(key)].get_from_short_key(value)
        if key in _DURATIONS and min(value['sec'], value['nsec']) >= 0:
            return Duration(seconds=value['sec'], nanoseconds=value['nsec'])
        if key == 'depth' and type(value) is int and value >= 0:
            return value
        if key == 'avoid_ros_namespace_conventions' and isinstance(value, bool):
            return value
    except (AttributeError, KeyError, TypeError, OverflowError):
        pass
    known = ('depth', *_POLICIES, *_DURATIONS, 'avoid_ros_namespace_conventions')
    problem = 'is not valid' if key in known else f'is not known: {", ".join(known)} are'
    raise FileFormatError(path, f'{field} = {value!r}: {problem}')
