"""Small bags for tests, made without a graph."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from goalreach_bags.metadata import BagMetadata
from goalreach_bags.options import StorageOptions
from goalreach_bags.topic import DEFAULT_OFFER, BagTopic, message_definition
from goalreach_bags.writer import BagWriter

JOINTS = 'sensor_msgs/msg/JointState'
STRING = 'std_msgs/msg/String'
STORE = get_typestore(Stores.ROS2_JAZZY)


def text_message(text: str) -> bytes:
    """Return a serialized std_msgs/String."""
    return serialize(STORE.types[STRING](data=text), STRING)


def serialize(message: Any, type_name: str) -> bytes:  # noqa: ANN401 - any message
    """Return a message of rosbags' own types serialized."""
    return bytes(STORE.serialize_cdr(message, type_name))


def joints(position: list[float], frame: str = 'map') -> Any:  # noqa: ANN401 - a message of rosbags' own types
    """Return a sensor_msgs/JointState of two joints."""
    types: Any = STORE.types
    stamp = types['builtin_interfaces/msg/Time'](sec=1, nanosec=0)
    empty = np.zeros(0)
    return types[JOINTS](
        header=types['std_msgs/msg/Header'](stamp=stamp, frame_id=frame),
        name=['a', 'b'],
        position=np.array(position),
        velocity=empty,
        effort=empty,
    )


def status(**values: str) -> Any:  # noqa: ANN401 - a message of rosbags' own types
    """Return a diagnostic_msgs/DiagnosticStatus with texts by key."""
    types: Any = STORE.types
    pairs = [types['diagnostic_msgs/msg/KeyValue'](key=k, value=v) for k, v in values.items()]
    return types['diagnostic_msgs/msg/DiagnosticStatus'](
        level=0, name='n', message='m', hardware_id='h', values=pairs
    )


def string_topic(name: str = '/text', **changes: Any) -> BagTopic:  # noqa: ANN401
    """Return a topic of std_msgs/String."""
    values: dict[str, Any] = {
        'name': name,
        'type_name': STRING,
        'type_hash': STORE.hash_rihs01(STRING),
        'offers': (DEFAULT_OFFER,),
        'definition': message_definition(STRING),
    }
    return BagTopic(**{**values, **changes})


def write_bag(
    path: Path,
    messages: Iterable[tuple[str, int, bytes]],
    *,
    topics: Iterable[BagTopic] = (string_topic(),),
    custom: dict[str, str] | None = None,
    **options: Any,  # noqa: ANN401 - fields of StorageOptions
) -> BagMetadata:
    """Write a bag of (topic, receive time, serialized message)."""
    writer = BagWriter(path, StorageOptions(**options), now=lambda: 0.0)
    for topic in topics:
        writer.add_topic(topic)
    for name, time_ns, data in messages:
        writer.write(name, time_ns, data)
    return writer.close(custom)


def texts(count: int, size: int = 10) -> list[tuple[str, int, bytes]]:
    """Return messages of `/text`, a millisecond apart, each of a text of its own."""
    return [
        ('/text', 1_000_000 * (k + 1), text_message(f'{k:06d}' + 'x' * size)) for k in range(count)
    ]
