"""Differences between two messages, two bags, and between a recorded run and a recomputed one."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
import hashlib
import itertools
import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from goalreach_bags.decode import Decoder, flatten
from goalreach_bags.reader import BagReader
from goalreach_bags.storage import BagMessage
from goalreach_msgs_py import topics
from goalreach_msgs_py.errors import GoalreachError

WALL_CLOCK_TOPICS: Final = ('/rosout', '/parameter_events')
"""Their messages depend on the wall clock and on processes, so two runs never have the same."""

OUTPUTS: Final = (topics.LANDMARKS, topics.POSE, topics.STATE, topics.HEAD_COMMAND)
"""Outputs of perception and state estimation, each after those it is computed from."""

_Bags = tuple[BagReader, BagReader]
_Digest = tuple[int, bytes]


class FieldDifference(NamedTuple):
    """One field in which two messages differ.

    Attributes:
        field: Its dotted name, with the index of the worst element for an array.
        first: Its value in the first message.
        second: Its value in the second.
        amount: Absolute difference; infinite where one is no number.
    """

    field: str
    first: Any
    second: Any
    amount: float


def differences(first: object, second: object) -> Iterator[FieldDifference]:
    """Yield the fields in which two messages differ.

    Texts that both are numbers are compared as numbers, since diagnostics carry values that way.
    NaN equals NaN: it means "not seen".

    Args:
        first: A message.
        second: Another one of the same type.
    """
    for mine, yours in itertools.zip_longest(flatten(first), flatten(second)):
        if mine is None or yours is None or mine[0] != yours[0]:
            (name, _), values = mine or yours, (mine and mine[1], yours and yours[1])
            yield FieldDifference(name, *values, math.inf)
            return
        if difference := _compare_field(mine[0], mine[1], yours[1]):
            yield difference


def _compare_field(name: str, first: Any, second: Any) -> FieldDifference | None:  # noqa: ANN401
    left, right = _numbers(first), _numbers(second)
    if left is None or right is None:
        return None if first == second else FieldDifference(name, first, second, math.inf)
    if left.shape != right.shape:
        return FieldDifference(f'{name}.length', len(left), len(right), math.inf)
    with np.errstate(invalid='ignore'):
        distances = np.abs(left - right)
    distances[(left == right) | (np.isnan(left) & np.isnan(right))] = 0.0
    distances[np.isnan(distances)] = math.inf
    if not distances.any():
        return None
    worst = int(distances.argmax())
    amount = float(distances[worst])
    if isinstance(first, np.ndarray):
        name, first, second = f'{name}[{worst}]', first.item(worst), second.item(worst)
    return FieldDifference(name, first, second, amount)


def _numbers(value: Any) -> NDArray[np.longdouble] | None:  # noqa: ANN401 - a field of any type
    """Return numbers such that 64-bit integers differ, too; None where it is none."""
    try:
        if isinstance(value, np.ndarray):
            return value.astype(np.longdouble)
        return np.array([value if isinstance(value, int) else float(value)], np.longdouble)
    except (TypeError, ValueError):
        return None


@dataclass(frozen=True, kw_only=True)
class TopicComparison:
    """Comparison of one topic in two bags.

    Attributes:
        counts: Messages in either bag.
        where: Number and time of the first message that differs, and the field with both
            values; empty where all messages are the same.
        time_ns: Receive time of that message in the first bag that has it, or None.
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
    first: BagReader, second: BagReader, includes: Callable[[str], bool], *, times: bool = True
) -> list[TopicComparison]:
    """Compare topic by topic, message by message in order: receive time and bytes.

    Args:
        first: A bag.
        second: Another one.
        includes: Whether to compare a topic, by its name.
        times: Whether to compare receive times.

    Returns:
        One comparison per topic, those that differ first, the earliest difference on top.
    """
    names = sorted(name for name in {*first.topics, *second.topics} if includes(name))
    bags = (first, second)
    mine, yours = (_digests(bag, names, times=times) for bag in bags)
    found = [_compare_topic(name, bags, (mine[name], yours[name])) for name in names]
    return sorted(found, key=lambda c: (c.same, c.time_ns or 0, c.topic))


def _digests(bag: BagReader, names: Iterable[str], *, times: bool) -> dict[str, list[_Digest]]:
    digests: dict[str, list[_Digest]] = {name: [] for name in names}
    for message in bag.messages(digests.keys()):
        digest = hashlib.blake2b(message.data, digest_size=16).digest()
        digests[message.topic].append((message.time_ns if times else 0, digest))
    return digests


def _compare_topic(
    name: str, bags: _Bags, digests: tuple[list[_Digest], list[_Digest]]
) -> TopicComparison:
    counts = (len(digests[0]), len(digests[1]))
    types = [bag.topics[name].type_name for bag in bags if name in bag.topics]
    result = partial(TopicComparison, topic=name, counts=counts)
    if len(types) == 1:
        return result(where='only in one of them', time_ns=0)
    if types[0] != types[1]:
        return result(where=f'{types[0]} in one, {types[1]} in the other', time_ns=0)
    for index, pair in enumerate(itertools.zip_longest(*digests)):
        if pair[0] != pair[1]:
            time_ns = _nth(bags[0] if pair[0] else bags[1], name, index).time_ns
            return result(where=_describe(name, index, bags, pair), time_ns=time_ns)
    return result()


def _describe(
    name: str, index: int, bags: _Bags, digests: tuple[_Digest | None, _Digest | None]
) -> str:
    left, right = digests
    if left is None or right is None:
        return f'message {index}: only in the {"second" if left is None else "first"}'
    messages = [_nth(bag, name, index) for bag in bags]
    where = f'message {index} at {messages[0].time_ns * 1e-9:.3f} s'
    if left[1] == right[1]:
        return f'{where}: received at {messages[1].time_ns * 1e-9:.3f} s in the second'
    try:
        values = [
            Decoder([bag.topics[name]]).decode(name, message.data)
            for bag, message in zip(bags, messages, strict=True)
        ]
    except GoalreachError as error:
        return f'{where}: other bytes, not decoded: {error}'
    for difference in differences(*values):
        return f'{where}: {difference.field} = {difference.first} and {difference.second}'
    return f'{where}: the same values in other bytes'


def _nth(bag: BagReader, name: str, index: int) -> BagMessage:
    return next(itertools.islice(bag.messages([name]), index, None))


@dataclass
class TopicResult:
    """Comparison of one recomputed topic.

    Attributes:
        different: Messages that differ beyond the tolerance.
        worst: Largest difference of a field, tolerated or not.
        first: The first difference beyond the tolerance, the recorded value first, or None.
        first_ns: Stamp of its message.
    """

    topic: str
    compared: int = 0
    different: int = 0
    worst: float = 0.0
    worst_field: str = ''
    first: FieldDifference | None = None
    first_ns: float = math.inf

    @property
    def same(self) -> bool:
        """Whether nothing differs beyond the tolerance, and something was compared."""
        return self.compared > 0 and not self.different

    def add(
        self, decoder: Decoder, stamp_ns: int, messages: tuple[bytes, bytes], tolerance: float
    ) -> None:
        """Compare a pair of messages, the recorded one first; a field may differ by the tolerance.

        Raises:
            GoalreachError: One of them is no message of the topic's type.
        """
        self.compared += 1
        if messages[0] == messages[1]:
            return
        found = list(differences(*(decoder.decode(self.topic, data) for data in messages)))
        for difference in found:
            if difference.amount > self.worst:
                self.worst, self.worst_field = difference.amount, difference.field
        beyond = [d for d in found if not d.amount <= tolerance]
        if beyond:
            self.different += 1
            if self.first is None:
                self.first, self.first_ns = beyond[0], stamp_ns
