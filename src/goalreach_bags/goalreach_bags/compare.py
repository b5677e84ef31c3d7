"""Whether two bags hold the same messages, and where they first differ."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
import hashlib
import itertools
import math
from typing import Final

from goalreach_bags.decode import Decoder, FieldDifference, differences
from goalreach_bags.reader import BagMessage, BagReader
from goalreach_msgs_py import topics

WALL_CLOCK_TOPICS: Final = ('/rosout', '/parameter_events')
"""Their content is of the wall clock and of processes, never the same twice."""

_Digest = tuple[int, bytes]


@dataclass(frozen=True, kw_only=True)
class TopicComparison:
    """What comparing a topic showed.

    Attributes:
        topic: Its name.
        counts: Messages in either bag.
        where: Empty where all is the same; else number and stamp of the first message that
            differs, and the field with both values.
        time_ns: Receive time of that message in the first bag that has it; None where all is
            the same.
    """

    topic: str
    counts: tuple[int, int]
    where: str = ''
    time_ns: int | None = None

    @property
    def same(self) -> bool:
        """Whether the topic is the same in both bags."""
        return not self.where


def compare_bags(
    first: BagReader,
    second: BagReader,
    includes: Callable[[str], bool],
    *,
    times: bool = True,
) -> list[TopicComparison]:
    """Compare topic by topic, message by message in order: receive time and bytes.

    Args:
        first: A bag.
        second: Another one.
        includes: Tells by its name whether a topic is compared.
        times: Whether receive times count.

    Returns:
        One comparison per topic, those that differ first, the earliest difference on top.
    """
    names = sorted(name for name in {*first.topics, *second.topics} if includes(name))
    mine, yours = _digests(first, names), _digests(second, names)
    if not times:
        mine, yours = _without_times(mine), _without_times(yours)
    found = [_compare(name, mine[name], yours[name], first, second) for name in names]
    return sorted(found, key=lambda c: (c.same, c.time_ns or 0, c.topic))


def _digests(bag: BagReader, names: Iterable[str]) -> dict[str, list[_Digest]]:
    digests: dict[str, list[_Digest]] = {name: [] for name in names}
    for message in bag.messages(digests.keys()):
        digest = hashlib.blake2b(message.data, digest_size=16).digest()
        digests[message.topic].append((message.time_ns, digest))
    return digests


def _without_times(digests: dict[str, list[_Digest]]) -> dict[str, list[_Digest]]:
    return {name: [(0, digest) for _, digest in values] for name, values in digests.items()}


def _compare(
    name: str,
    mine: Sequence[_Digest],
    yours: Sequence[_Digest],
    first: BagReader,
    second: BagReader,
) -> TopicComparison:
    counts = (len(mine), len(yours))
    types = [bag.topics[name].type_name for bag in (first, second) if name in bag.topics]
    if len(types) == 1:
        return TopicComparison(topic=name, counts=counts, where='only in one of them', time_ns=0)
    if types[0] != types[1]:
        where = f'{types[0]} in one, {types[1]} in the other'
        return TopicComparison(topic=name, counts=counts, where=where, time_ns=0)
    for index, (left, right) in enumerate(itertools.zip_longest(mine, yours)):
        if left != right:
            where = _describe(name, index, first, second, (left, right))
            time_ns = _nth(first if left else second, name, index).time_ns
            return TopicComparison(topic=name, counts=counts, where=where, time_ns=time_ns)
    return TopicComparison(topic=name, counts=counts)


def _describe(
    name: str,
    index: int,
    first: BagReader,
    second: BagReader,
    pair: tuple[_Digest | None, _Digest | None],
) -> str:
    left, right = pair
    if left is None or right is None:
        return f'message {index}: only in the {"second" if left is None else "first"}'
    messages = [_nth(bag, name, index) for bag in (first, second)]
    where = f'message {index} at {messages[0].time_ns * 1e-9:.3f} s'
    if left[1] == right[1]:
        return f'{where}: received at {messages[1].time_ns * 1e-9:.3f} s in the second'
    values = [
        Decoder([bag.topics[name]]).decode(name, message.data)
        for bag, message in zip((first, second), messages, strict=True)
    ]
    for difference in differences(*values):
        return f'{where}: {difference.field} = {difference.first} and {difference.second}'
    return f'{where}: the same values in other bytes'


def _nth(bag: BagReader, name: str, index: int) -> BagMessage:
    return next(itertools.islice(bag.messages([name]), index, None))


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
