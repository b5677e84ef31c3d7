"""Which nodes live, and how often each topic speaks, from what was heard and when."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
import enum
from typing import Final

_SILENT_S: Final = 0.8
"""Silence after which a node is no longer taken for alive; a killed one is told within 2 s."""
_SHOWN_S: Final = 2.0
"""How long a silence is shown at least: a launcher may start a dead node again at once."""
_WINDOW_S: Final = 2.0
_SAMPLE_S: Final = 0.5


class NodeStatus(enum.Enum):
    """What is known of a node."""

    UP = 'up'
    QUIET = 'quiet'
    DOWN = 'down'
    UNSEEN = 'unseen'


@dataclass
class TopicRate:
    """Messages of one topic, by the publisher's own count: none need be taken to be counted.

    Attributes:
        heard_s: When the last message was noticed, or None.
        total: Messages so far.
    """

    heard_s: float | None = None
    total: int = 0
    _number: int | None = None
    _samples: deque[tuple[float, int]] = field(default_factory=deque)

    def record_message(self, now_s: float, number: int) -> None:
        """Take note of a message.

        Args:
            now_s: Wall time.
            number: The publisher's sequence number, ascending; another publisher may start anew.
        """
        if number == self._number:
            return
        step = 1 if self._number is None or number < self._number else number - self._number
        self._number = number
        self.total += step
        self.heard_s = now_s

    def rate_hz(self, now_s: float) -> float:
        """Return messages per second over the last two seconds; renewed twice a second."""
        if not self._samples or now_s - self._samples[-1][0] >= _SAMPLE_S:
            self._samples.append((now_s, self.total))
        while len(self._samples) > 1 and now_s - self._samples[0][0] > _WINDOW_S:
            self._samples.popleft()
        (began_s, before), (ended_s, after) = self._samples[0], self._samples[-1]
        return (after - before) / (ended_s - began_s) if ended_s > began_s else 0.0


class Health:
    """Nodes by what they publish and whether they answer.

    Args:
        topics_of: By node, the topics that only it publishes.
    """

    def __init__(self, topics_of: Mapping[str, tuple[str, ...]]) -> None:
        """Know no topic yet."""
        self._topics_of = dict(topics_of)
        self._answered_s: dict[str, float] = {}
        self._down_s: dict[str, float] = {}
        self.topics: dict[str, TopicRate] = {}

    @property
    def nodes(self) -> tuple[str, ...]:
        """Names of the nodes watched."""
        return tuple(self._topics_of)

    def record_message(self, topic: str, now_s: float, number: int) -> None:
        """Take note of a message of a topic."""
        self.topics.setdefault(topic, TopicRate()).record_message(now_s, number)

    def record_answer(self, node: str, now_s: float) -> None:
        """Take note that a node answered a question."""
        self._answered_s[node] = now_s

    def status(self, node: str, now_s: float) -> NodeStatus:
        """Return what is known of a node.

        UP publishes; QUIET answers and publishes nothing (the simulation stands still, or its
        inputs are missing); DOWN does neither, and once did, or has only just come back.
        """
        status = self._status(node, now_s)
        if status is NodeStatus.DOWN:
            self._down_s.setdefault(node, now_s)
        elif now_s - self._down_s.get(node, -_SHOWN_S) < _SHOWN_S:
            return NodeStatus.DOWN
        else:
            self._down_s.pop(node, None)
        return status

    def _status(self, node: str, now_s: float) -> NodeStatus:
        heard_s, answered_s = self._heard_s(node), self._answered_s.get(node)
        if heard_s is not None and now_s - heard_s < _SILENT_S:
            return NodeStatus.UP
        if answered_s is not None and now_s - answered_s < _SILENT_S:
            return NodeStatus.QUIET
        return NodeStatus.UNSEEN if heard_s is answered_s is None else NodeStatus.DOWN

    def silent_s(self, node: str, now_s: float) -> float:
        """Return for how long a node has given no sign of life; 0 where it never did."""
        signs = [t for t in (self._heard_s(node), self._answered_s.get(node)) if t is not None]
        return now_s - max(signs) if signs else 0.0

    def _heard_s(self, node: str) -> float | None:
        heard = [
            rate.heard_s
            for topic in self._topics_of[node]
            if (rate := self.topics.get(topic)) is not None and rate.heard_s is not None
        ]
        return max(heard, default=None)
