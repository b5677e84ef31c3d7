"""Small bags for tests, made without a graph."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
import struct
from typing import Any

from mcap.writer import Writer
import numpy as np
from rosbags.typesys import Stores, get_typestore

from goalreach_bags.metadata import BagMetadata
from goalreach_bags.options import StorageOptions
from goalreach_bags.topic import BagTopic, message_definition
from goalreach_bags.writer import BagWriter

JOINTS = 'sensor_msgs/msg/JointState'
STRING = 'std_msgs/msg/String'
STORE = get_typestore(Stores.ROS2_JAZZY)
FOREIGN_COUNT = 60
UNKNOWN_RECORD = struct.pack('<BQ', 0x80, 5) + b'mine!'
QOS_8 = (
    '- history: 3\n  depth: 0\n  reliability: 1\n  durability: 2\n'
    '  deadline: {sec: 9223372036, nsec: 854775807}\n'
    '  lifespan: {sec: 9223372036, nsec: 854775807}\n  liveliness: 1\n'
    '  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}\n'
    '  avoid_ros_namespace_conventions: false\n'
)

INFINITE = {'sec': 9223372036, 'nsec': 854775807}
DEFAULT_OFFER = {
    'history': 'unknown',
    'depth': 0,
    'reliability': 'reliable',
    'durability': 'volatile',
    'deadline': {**INFINITE},
    'lifespan': {**INFINITE},
    'liveliness': 'automatic',
    'liveliness_lease_duration': {**INFINITE},
    'avoid_ros_namespace_conventions': False,
}
"""ROS 2's default as DDS shows it to others: history and depth are unknown."""


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
    writer.custom.update(custom or {})
    return writer.close()


def texts(count: int, size: int = 10) -> list[tuple[str, int, bytes]]:
    """Return messages of `/text`, a millisecond apart, each of a text of its own."""
    return [
        ('/text', 1_000_000 * (k + 1), text_message(f'{k:06d}' + 'x' * size)) for k in range(count)
    ]


def write_foreign(path: Path, **options: Any) -> None:  # noqa: ANN401 - options of mcap's writer
    """Write a ROS topic and a schemaless one, an attachment, metadata and an unknown record."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open('wb') as stream:
        writer = Writer(stream, chunk_size=4000, **options)
        writer.start('ros2', library='somebody')
        definition = message_definition(STRING).encode()
        schema = writer.register_schema(STRING, 'ros2msg', definition)
        qos = {'offered_qos_profiles': QOS_8}
        text = writer.register_channel('/text', 'cdr', schema, qos)
        json = writer.register_channel('/json', 'json', 0)
        writer.add_attachment(1, 2, 'notes.txt', 'text/plain', b'remember')
        writer.add_metadata('mine', {'a': 'b'})
        for number in range(FOREIGN_COUNT):
            data = text_message(f'{number:06d}' + 'x' * 300)
            writer.add_message(text, 1000 + number, data, 1000 + number, number)
            writer.add_message(json, 1000 + number, b'{}', 1000 + number, number)
        writer.flush()  # type: ignore[no-untyped-call]
        stream.write(UNKNOWN_RECORD)
        writer.finish()  # type: ignore[no-untyped-call]
