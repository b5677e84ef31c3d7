"""Subscriptions that are emptied when it suits the page, not when a message comes.

A page shows 20 pictures a second, whatever the graph's rate. A tap keeps the newest messages in
the middleware and takes them on demand; what is not taken is never converted, and messages are
counted by their publisher's sequence number.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import time
from typing import Any, Final

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import UInt8MultiArray

from goalreach_msgs_py.ros.common_messages import MessageError
from goalreach_msgs_py.ros.throttled import glimpse_from_raw
from goalreach_msgs_py.topics import glimpse_topic


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


_DEPTH: Final = 10
_PATIENCE_S: Final = 0.3
"""For so long a node's topics may be known before its glimpse is. Chosen."""
_THROTTLE_S: Final = 5.0


@dataclass(frozen=True)
class Source:
    """One topic of a node.

    Attributes:
        message_type: Type of its messages.
        topic: Its name.
        depth: How many messages are kept where there is no glimpse.
    """

    message_type: type[Any]
    topic: str
    depth: int = 1


class NodeTap:
    """The topics of one node.

    Args:
        node: A node that is on no executor.
        name: Name of the node listened to.
        sources: Its topics.
        told: Topics that its glimpses tell the number of messages of, and no more.
        note: Called with a topic and the number of its last message.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        sources: Sequence[Source],
        *,
        told: Sequence[str] = (),
        note: Callable[[str, int], None],
    ) -> None:
        """Listen to glimpses; whether there are any is seen later."""
        self._node = node
        self._sources = sources
        self._note = note
        self._topic = glimpse_topic(f'/{name}')
        # Uncounted: what glimpses hold counts.
        self._glimpses = Tap(node, UInt8MultiArray, self._topic, depth=_DEPTH, raw=True)
        self._glimpsed = False
        self._held: set[str] | None = None
        self._plain: dict[str, Tap] = {}
        topics = [*(each.topic for each in sources), *told]
        self._contract = {node.resolve_topic_name(topic): topic for topic in topics}
        self._alone_s = time.monotonic()

    def covers(self, topic: str) -> bool:
        """Return whether glimpses hold a topic, or will, as far as is known."""
        return self._glimpsed and (self._held is None or topic in self._held)

    def take(self) -> dict[str, list[bytes]]:
        """Return, by topic, the messages that came since the last call, the oldest first."""
        self._choose(time.monotonic())
        heard: dict[str, list[bytes]] = {}
        for glimpse in self._glimpses.take():
            self._read(glimpse, heard)
        for topic, tap in self._plain.items():
            heard.setdefault(topic, []).extend(tap.take())
        return heard

    def _read(self, glimpse: bytes, heard: dict[str, list[bytes]]) -> None:
        try:
            messages = glimpse_from_raw(glimpse)
        except MessageError as error:
            text = f'{self._topic}: {error}'
            self._node.get_logger().warning(text, throttle_duration_sec=_THROTTLE_S)
            return
        numbers: dict[str, int] = {}
        for name, number, message in messages:
            topic = self._contract.get(name)
            if topic is None:
                continue
            numbers[topic] = number
            if message:
                heard.setdefault(topic, []).append(message)
        self._held = set(numbers)
        for topic, number in numbers.items():
            self._note(topic, number)

    def _choose(self, now_s: float) -> None:
        """Listen to the topics themselves that have been there for a moment without a glimpse."""
        self._glimpsed = self._node.count_publishers(self._topic) > 0
        if not self._glimpsed:
            self._held = None
        for topic in [topic for topic in self._plain if self.covers(topic)]:
            self._plain.pop(topic).close()
        missing = [
            each
            for each in self._sources
            if each.topic not in self._plain and not self.covers(each.topic)
        ]
        spoken = [each for each in missing if self._node.count_publishers(each.topic)]
        if not (spoken or self._plain):
            self._alone_s = now_s
        if now_s - self._alone_s < _PATIENCE_S:
            return
        for each in spoken:
            self._plain[each.topic] = Tap(
                self._node,
                each.message_type,
                each.topic,
                note=self._note,
                depth=each.depth,
                raw=True,
            )
