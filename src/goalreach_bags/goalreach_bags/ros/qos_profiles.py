"""Quality of service of recorded and replayed topics: from the graph, to the bag and back."""

from collections.abc import Mapping, Sequence
import contextlib
from pathlib import Path
from typing import Any, Final

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    InvalidQoSProfileException,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from goalreach_bags.topic import DURATIONS, BagTopic, Offer, message_definition
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.files import read_yaml

_INFINITE: Final = {'sec': 9223372036, 'nsec': 854775807}
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


def _offer(profile: QoSProfile) -> Offer:
    def duration(name: str) -> dict[str, int]:
        sec, nsec = divmod(getattr(profile, name).nanoseconds, 10**9)
        return {'sec': sec, 'nsec': nsec}

    return {
        'history': profile.history.short_key,
        'depth': profile.depth,
        'reliability': profile.reliability.short_key,
        'durability': profile.durability.short_key,
        'deadline': duration('deadline'),
        'lifespan': duration('lifespan'),
        'liveliness': profile.liveliness.short_key,
        'liveliness_lease_duration': duration('liveliness_lease_duration'),
        'avoid_ros_namespace_conventions': False,
    }


def publisher_profile(offers: Sequence[Offer]) -> QoSProfile:
    """Return the profile with which to publish a topic of a bag again.

    Where publishers differed, the strictest of reliability and durability, so that every
    subscriber that was served by one of them is served again.
    """
    best_effort = {offer['reliability'] for offer in offers} == {'best_effort'}
    latched = sum(offer['durability'] == 'transient_local' for offer in offers)
    depth = max((offer['depth'] for offer in offers), default=0) or latched or _REPLAY_DEPTH
    profile = QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        liveliness=LivelinessPolicy.AUTOMATIC,
    )
    deadlines = [offer['deadline'] for offer in offers]
    if deadlines and all(one == deadlines[0] != _INFINITE for one in deadlines):
        with contextlib.suppress(OverflowError):  # as good as infinite
            profile.deadline = _duration(deadlines[0])
    return profile


def _duration(value: Mapping[str, int]) -> Duration:
    return Duration(seconds=value['sec'], nanoseconds=value['nsec'])


_POLICIES: Final = {
    'history': HistoryPolicy,
    'reliability': ReliabilityPolicy,
    'durability': DurabilityPolicy,
    'liveliness': LivelinessPolicy,
}


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
        if key in DURATIONS and min(value['sec'], value['nsec']) >= 0:
            return _duration(value)
        if key == 'depth' and type(value) is int and 0 <= value < 2**31:
            return value
        if key == 'avoid_ros_namespace_conventions' and isinstance(value, bool):
            return value
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
        pass
    known = ('depth', *_POLICIES, *DURATIONS, 'avoid_ros_namespace_conventions')
    problem = 'is not valid' if key in known else f'is not known: {", ".join(known)} are'
    raise FileFormatError(path, f'{field} = {value!r}: {problem}')
