"""What a bag says about a topic: type, definition, hash and the offered quality of service."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import yaml

from goalreach_msgs_py.yaml_text import load_yaml

__all__ = ['INFINITE_NS', 'BagTopic', 'QosOffer', 'offers_to_text', 'parse_offers']

INFINITE_NS: Final = 2**63 - 1
"""A duration without end; rosbag2 writes it as 9223372036 s and 854775807 ns."""

_NS_PER_S: Final = 1_000_000_000
_DURATIONS: Final = ('deadline', 'lifespan', 'liveliness_lease_duration')


@dataclass(frozen=True, kw_only=True)
class QosOffer:
    """Quality of service that one publisher offered, in the words of rosbag2's version 9.

    Attributes:
        history: 'keep_last', 'keep_all' or 'unknown': DDS does not tell it to others.
        depth: 0 where unknown.
        reliability: 'reliable' or 'best_effort'.
        durability: 'transient_local' or 'volatile'.
        liveliness: 'automatic' or 'manual_by_topic'.
        deadline_ns: Promised time between messages.
        lifespan_ns: How long a message is worth something.
        liveliness_lease_duration_ns: Within which the publisher shows that it lives.
    """

    history: str = 'unknown'
    depth: int = 0
    reliability: str = 'reliable'
    durability: str = 'volatile'
    liveliness: str = 'automatic'
    deadline_ns: int = INFINITE_NS
    lifespan_ns: int = INFINITE_NS
    liveliness_lease_duration_ns: int = INFINITE_NS

    def to_document(self) -> dict[str, Any]:
        """Return the mapping that rosbag2 writes, keys in its order."""
        return {
            'history': self.history,
            'depth': self.depth,
            'reliability': self.reliability,
            'durability': self.durability,
            'deadline': _duration(self.deadline_ns),
            'lifespan': _duration(self.lifespan_ns),
            'liveliness': self.liveliness,
            'liveliness_lease_duration': _duration(self.liveliness_lease_duration_ns),
            'avoid_ros_namespace_conventions': False,
        }


@dataclass(frozen=True, kw_only=True)
class BagTopic:
    """One topic of a bag.

    Attributes:
        name: Name with its leading slash.
        type_name: `package/msg/Name`.
        type_hash: `RIHS01_...`, or empty where the bag does not tell it.
        offers: What each publisher offered.
        definition: Text of the message definition with all that it is made of.
        encoding: Format of the definition, `ros2msg` or `ros2idl`.
    """

    name: str
    type_name: str
    type_hash: str
    offers: tuple[QosOffer, ...]
    definition: str
    encoding: str = 'ros2msg'


def _duration(value_ns: int) -> dict[str, int]:
    return {'sec': value_ns // _NS_PER_S, 'nsec': value_ns % _NS_PER_S}


def offers_to_text(offers: Sequence[QosOffer]) -> str:
    """Return offers as the YAML text inside MCAP channels and SQLite topics."""
    documents = [offer.to_document() for offer in offers]
    return yaml.safe_dump(documents, sort_keys=False) if documents else ''


def parse_offers(text: str) -> tuple[QosOffer, ...]:
    """Return the offers of such a text; of one that is not understood, none."""
    try:
        documents = load_yaml(text) or []
        return tuple(_offer(document) for document in documents)
    except (yaml.YAMLError, TypeError, KeyError, AttributeError, ValueError, OverflowError):
        return ()


def _offer(document: dict[str, Any]) -> QosOffer:
    times = {
        f'{name}_ns': int(document[name]['sec']) * _NS_PER_S + int(document[name]['nsec'])
        for name in _DURATIONS
    }
    words = {
        name: str(document[name])
        for name in ('history', 'reliability', 'durability', 'liveliness')
    }
    return QosOffer(depth=int(document['depth']), **words, **times)  # type: ignore[arg-type]
