"""Serialized messages through rclpy's own objects and through the other byte order."""

from __future__ import annotations

from typing import Any

from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_typestore

_STORE = get_typestore(Stores.ROS2_JAZZY)


def as_object(raw: bytes, message_type: type[Any]) -> Any:
    """Return a message as rclpy reads it."""
    return deserialize_message(raw, message_type)


def changed(raw: bytes, message_type: type[Any], **fields: object) -> bytes:
    """Return a message with other values of some fields, as rclpy serializes it."""
    message = deserialize_message(raw, message_type)
    for name, value in fields.items():
        setattr(message, name, value)
    return bytes(serialize_message(message))


def by_others(raw: bytes, message_type: type[Any]) -> list[bytes]:
    """Return a message as it is; serialized by rclpy; from another frame; big-endian; padded."""
    name = f'{message_type.__module__.split(".")[0]}/msg/{message_type.__name__}'
    elsewhere = deserialize_message(raw, message_type)
    if hasattr(elsewhere, 'header'):
        elsewhere.header.frame_id = 'somewhere/else'
    value = _STORE.deserialize_cdr(raw, name)
    big_endian = bytes(_STORE.serialize_cdr(value, name, little_endian=False))
    return [
        raw,
        bytes(serialize_message(deserialize_message(raw, message_type))),
        bytes(serialize_message(elsewhere)),
        big_endian,
        raw + bytes(3),
    ]
