"""Subscriptions that are emptied when it suits the page, not when a message comes.

A page shows 20 pictures a second, whatever the graph's rate. A tap keeps the newest messages in
the middleware and takes them on demand; what is not taken is never converted, and messages are
counted by their publisher's sequence number.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

__all__ = ['Tap']


class Tap:
    """One topic.

    Args:
        node: A node that is on no executor.
        message_type: Type of the messages.
        topic: Name of the topic.
        depth: How many messages are kept.
        reliable: Whether none may be lost on the way.
        latched: Whether what was sent before counts.
        raw: Whether messages are left in bytes, not converted.
        note: Called with the topic and each message's sequence number; None where nobody counts.
    """

    def __init__(
        self,
        node: Node,
        message_type: type[Any],
        topic: str,
        *,
        note: Callable[[str, int], None] | None = None,
        depth: int = 1,
        reliable: bool = False,
        latched: bool = False,
        raw: bool = False,
    ) -> None:
        """Subscribe."""
        strict = reliable or latched
        qos = QoSProfile(
            depth=depth,
            reliability=ReliabilityPolicy.RELIABLE if strict else ReliabilityPolicy.BEST_EFFORT,
            durability=(
                DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
            ),
        )
        self._node = node
        self._topic = topic
        self._note = note
        self._taken = 0
        self._subscription = node.create_subscription(
            message_type, topic, _not_called, qos, raw=raw
        )

    def take(self) -> list[Any]:
        """Return the messages that came since the last call, the oldest first."""
        messages: list[Any] = []
        subscription = self._subscription
        with subscription.handle:
            while True:
                taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
                if taken is None:
                    return messages
                message, info = taken
                self._taken += 1
                number = info.get('publication_sequence_number') or self._taken
                if self._note is not None:
                    self._note(self._topic, number)
                messages.append(message)

    def close(self) -> None:
        """Unsubscribe."""
        self._node.destroy_subscription(self._subscription)


def _not_called(_message: object) -> None:
    """Stand where rclpy wants a callback; the node is on no executor."""
