"""Subscriptions that hand messages over as bytes, and reading those of any layout."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.ros.common_messages import MessageError

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


SENSOR_QOS = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
"""ROS 2's sensor data profile: an old image is worth nothing (REP-2003)."""

NEWEST_QOS = QoSProfile(depth=2, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For who reads images. After a pause only the newest counts, and DDS keeps the buffer of a whole
image for each place of the queue that was ever full. With one place a hundredth of the images is
lost in real time, with two hardly any."""

RELIABLE_QOS = QoSProfile(depth=10)
"""States, commands and events."""

DEEP_QOS = QoSProfile(depth=200)
"""What is judged and counted: a listener that is late by 200 ticks still misses none."""

LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""What a late subscriber still needs: markers, Q-table."""
