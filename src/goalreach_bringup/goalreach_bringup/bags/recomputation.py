"""Comparing what perception publishes now with what it published when the bag was recorded."""

from __future__ import annotations

from dataclasses import dataclass, field
import math
from typing import Final

from goalreach_bringup.bags.decoder import Decoder
from goalreach_bringup.bags.message_diff import FieldDifference, differences
from goalreach_msgs_py import topics

__all__ = ['OUTPUTS', 'SENSORS', 'Recomputation', 'TopicResult']

SENSORS: Final = (
    topics.CAMERA_INFO,
    topics.JOINT_STATES,
    topics.ODOM,
    topics.BUMPERS,
    topics.IMAGE,
)
"""What is fed, the image last, as the robot sends it."""

OUTPUTS: Final = (topics.LANDMARKS, topics.POSE, topics.STATE, topics.HEAD_COMMAND)
"""What perception and state estimation answer, in the order in which one follows from another."""


@dataclass(frozen=True, kw_only=True)
class FirstDifference:
    """Where a topic differs for the first time.

    Attributes:
        stamp_ns: Stamp of the message.
        difference: The field, the recorded value first.
    """

    stamp_ns: int
    difference: FieldDifference


@dataclass
class TopicResult:
    """What recomputing showed of one topic.

    Attributes:
        topic: Its name.
        compared: Messages that were compared.
        different: Messages that differ beyond the tolerance.
        worst: Largest difference of a field, tolerated or not.
        worst_field: That field.
        first: The first difference beyond the tolerance, or None.
    """

    topic: str
    compared: int = 0
    different: int = 0
    worst: float = 0.0
    worst_field: str = ''
    first: FirstDifference | None = None

    @property
    def same(self) -> bool:
        """Whether nothing differs beyond the tolerance, and something was compared."""
        return self.compared > 0 and not self.different


@dataclass
class Recomputation:
    """Collects the comparison of every output, stamp by stamp.

    Attributes:
        decoder: Decoder of the bag's topics.
        tolerance: Largest difference of a field that counts as none.
        results: What was found, by topic.
    """

    decoder: Decoder
    tolerance: float
    results: dict[str, TopicResult] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Begin with nothing compared."""
        self.results = {name: TopicResult(topic=name) for name in OUTPUTS}

    def compare(self, topic: str, stamp_ns: int, recorded: bytes, recomputed: bytes) -> None:
        """Compare one message.

        Args:
            topic: Its topic.
            stamp_ns: Its stamp.
            recorded: As it is in the bag.
            recomputed: As it was published now.

        Raises:
            GoalreachError: One of them is no message of the topic's type.
        """
        result = self.results[topic]
        result.compared += 1
        if recorded == recomputed:
            return
        decode = self.decoder.decode
        beyond: FieldDifference | None = None
        for difference in differences(decode(topic, recorded), decode(topic, recomputed)):
            if difference.amount > result.worst:
                result.worst, result.worst_field = difference.amount, difference.field
            if beyond is None and not difference.amount <= self.tolerance:
                beyond = difference
        if beyond is not None:
            result.different += 1
            if result.first is None:
                result.first = FirstDifference(stamp_ns=stamp_ns, difference=beyond)

    def ordered(self) -> list[TopicResult]:
        """Return the results, the earliest difference first."""
        order = list(self.results.values())
        return sorted(order, key=lambda r: r.first.stamp_ns if r.first else math.inf)
