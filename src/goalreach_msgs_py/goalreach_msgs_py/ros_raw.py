"""Subscriptions that hand messages over as bytes, and reading those of any layout."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.ros_common_messages import MessageError

__all__ = ['read_message', 'subscribe_raw']

MessageT = TypeVar('MessageT')
_THROTTLE_S = 5.0


def read_message(raw: bytes, message_type: type[MessageT]) -> MessageT:
    """Return a message of any layout, read by rclpy.

    Raises:
        MessageError: It cannot be read.
    """
    try:
        message: MessageT = deserialize_message(raw, message_type)
    except RuntimeError as error:  # rclpy's RMWError
        raise MessageError(f'not readable: {error}') from None
    return message


def subscribe_raw(
    node: Node,
    message_type: type[Any],
    topic: str,
    callback: Callable[[int, bytes], None],
    qos: QoSProfile,
) -> None:
    """Subscribe to messages as bytes; the callback is given the stamp and the message.

    What is too short to hold a stamp is told and dropped.
    """

    def take(raw: bytes) -> None:
        stamp_ns = stamp_of(raw)
        if stamp_ns is None:
            line = f'{topic}: a message of {len(raw)} bytes is dropped'
            node.get_logger().error(line, throttle_duration_sec=_THROTTLE_S)
            return
        callback(stamp_ns, raw)

    node.create_subscription(message_type, topic, take, qos, raw=True)
