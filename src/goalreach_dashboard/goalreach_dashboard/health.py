"""Liveness of nodes and rates of topics, from what was received and when."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
import enum
import math
from typing import Final

_TIMEOUT_S: Final = 0.8
"""Silence after which a node counts as down: within 2 s of being killed it is shown."""
_MIN_DOWN_S: Final = 2.0
"""Shortest time for which a node is shown as down: launchers restart dead nodes at once."""
_RATE_WINDOW_S: Final = 2.0
_RATE_PERIOD_S: Final = 0.5


class NodeStatus(enum.Enum):
    """Liveness of a node.

    UP: it publishes. QUIET: it responds to services and publishes nothing, because the simulation
    is paused or an input is missing. DOWN: neither. UNSEEN: neither, ever.
    """

    UP = 'up'
    QUIET = 'quiet'
    DOWN = 'down'
    UNSEEN = 'unseen'


@dataclass
class TopicRate:
    """Counts the messages of one topic by sequence number, so that none need be taken.

    Attributes:
        received_s: Time of the last message; minus infinity before the first.
        total: Number of messages.
    """

    received_s: float = -math.inf
    total: int = 0
    _number: int | None = None
    _samples: deque[tuple[float, int]] = field(default_factory=deque)

    def record_message(self, now_s: float, number: int) -> None:
        """Record a message by the publisher's ascending number; a new publisher starts again."""
        if number == self._number:
            return
        step = 1 if self._number is None or number < self._number else number - self._number
        self._number = number
        self.total += step
        self.received_s = now_s

    def rate_hz(self, now_s: float) -> float:
        """Return messages per second over the last two seconds, updated twice a second."""
        if not self._samples or now_s - self._samples[-1][0] >= _RATE_PERIOD_S:
            self._samples.append((now_s, self.total))
        while len(self._samples) > 1 and now_s - self._samples[0][0] > _RATE_WINDOW_S:
            self._samples.popleft()
        (began_s, before), (ended_s, after) = self._samples[0], self._samples[-1]
        return (after - before) / (ended_s - began_s) if ended_s > began_s else 0.0


class GraphHealth:
    """Liveness of nodes, by the topics that only they publish and by responses to services.

    Attributes:
        topics: Rates by topic.
    """

    def __init__(self, topics_of: Mapping[str, tuple[str, ...]]) -> None:
        self.nodes = tuple(topics_of)
        self._topics_of = topics_of
        self._responded_s: dict[str, float] = {}
        self._down_s: dict[str, float] = {}
        self.topics: dict[str, TopicRate] = {}

    def record_message(self, topic: str, now_s: float, number: int) -> None:
        """Record a message of a topic; see `TopicRate.record_message`."""
        self.topics.setdefault(topic, TopicRate()).record_message(now_s, number)

    def record_response(self, node: str, now_s: float) -> None:
        """Record that a node responded to a service call."""
        self._responded_s[node] = now_s

    def status(self, node: str, now_s: float) -> NodeStatus:
        """Return the status of a node; one that was down is shown so for 2 s at least."""
        status = self._status(node, now_s)
        if status is NodeStatus.DOWN:
            self._down_s.setdefault(node, now_s)
        elif now_s - self._down_s.get(node, -_MIN_DOWN_S) < _MIN_DOWN_S:
            return NodeStatus.DOWN
        else:
            self._down_s.pop(node, None)
        return status

    def _status(self, node: str, now_s: float) -> NodeStatus:
        if now_s - self._published_s(node) < _TIMEOUT_S:
            return NodeStatus.UP
        if self.silence_s(node, now_s) < _TIMEOUT_S:
            return NodeStatus.QUIET
        return NodeStatus.UNSEEN if self.silence_s(node, now_s) == math.inf else NodeStatus.DOWN

    def silence_s(self, node: str, now_s: float) -> float:
        """Return the time since a node's last sign of life; infinity where it never gave one."""
        return now_s - max(self._published_s(node), self._responded_s.get(node, -math.inf))

    def _published_s(self, node: str) -> float:
        rates = (self.topics.get(topic, TopicRate()) for topic in self._topics_of[node])
        return max(rate.received_s for rate in rates)
