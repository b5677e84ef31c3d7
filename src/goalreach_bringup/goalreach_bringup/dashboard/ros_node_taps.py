"""What one node says: by its glimpses, or by the topics that these do not hold.

Nodes of goalreach show what they say 20 times a second, which costs them next to nothing. Those
of others, and bags, do not; and a topic may be remapped, and come from somewhere else. There the
topics themselves are listened to.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import time
from typing import Any, Final

from rclpy.node import Node
from std_msgs.msg import UInt8MultiArray

from goalreach_bringup.dashboard.ros_taps import Tap
from goalreach_msgs_py.ros_common_messages import MessageError
from goalreach_msgs_py.ros_raw_glimpse import glimpse_from_raw
from goalreach_msgs_py.topics import glimpse_topic

__all__ = ['NodeTap', 'Source']

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
