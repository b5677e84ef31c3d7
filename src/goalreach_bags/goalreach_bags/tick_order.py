"""Order of the messages of a lockstep run by its time, and count of lost messages.

DDS keeps no order between topics, so two recordings of the same run differ in it. In lockstep the
graph's clock stands still between an image and its answer: everything that belongs to a stamp was
published, and received, at that time. Within one stamp the order is that of the topics' names.
"""

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, field, replace
import math
from typing import Final

from goalreach_bags.storage import BagMessage

_HELD_TICKS: Final = 2
"""Ticks held back for late messages. All that belongs to a tick has been published when the next
one is answered; the second is for messages that overtake others on their way."""
_LONGEST_TICKS: Final = 64
"""Ticks held back where a robot lacks one of their topics. Chosen: some seconds."""

_BEFORE_FIRST_NS: Final = -1


@dataclass
class TickOrder:
    """Collects messages, detects complete ticks, and returns messages in order.

    Attributes:
        required: Topics that each tick has exactly one message of.
        unstamped: Topics without stamps whose nodes repeat a message that was lost.
        stamp_ns: The latest tick, or None before the first.
    """

    required: Sequence[str]
    unstamped: Container[str] = ()
    stamp_ns: int | None = None
    _missing: dict[int, set[str]] = field(default_factory=dict)
    _waiting: list[BagMessage] = field(default_factory=list)
    _last: dict[str, tuple[int | None, list[bytes]]] = field(default_factory=dict)

    def add(self, topic: str, stamp_ns: int | None, data: bytes) -> None:
        """Add a message, with a stamp if it has one, unless it is a repetition.

        That equals another of its topic at the last stamp; in `unstamped`, the one before.
        """
        last_ns, last = self._last.get(topic, (None, []))
        if data in last and (stamp_ns is not None or topic in self.unstamped):
            return
        others = last if stamp_ns is not None and stamp_ns == last_ns else []
        self._last[topic] = stamp_ns, [*others, data]
        if stamp_ns is None:
            stamp_ns = self.stamp_ns
        elif topic in self.required and not (self._missing and stamp_ns < min(self._missing)):
            self.stamp_ns = max(self.stamp_ns or 0, stamp_ns)
            self._missing.setdefault(stamp_ns, set(self.required)).discard(topic)
        time_ns = _BEFORE_FIRST_NS if stamp_ns is None else stamp_ns
        self._waiting.append(BagMessage(time_ns=time_ns, topic=topic, data=data))

    @property
    def complete(self) -> bool:
        """Whether the latest tick has a message of every required topic."""
        return self.stamp_ns is not None and not self._missing.get(self.stamp_ns)

    def settled(self) -> Iterator[BagMessage]:
        """Yield, in order, the messages before which no other can come any more."""
        if len(self._missing) <= (_HELD_TICKS if self.complete else _LONGEST_TICKS):
            return
        ticks = sorted(self._missing)
        self._missing = {stamp: self._missing[stamp] for stamp in ticks[-_HELD_TICKS:]}
        yield from self._take(ticks[-_HELD_TICKS])

    def rest(self) -> Iterator[BagMessage]:
        """Yield all remaining messages, in order."""
        yield from self._take(math.inf)

    def _take(self, limit_ns: float) -> Iterator[BagMessage]:
        """Yield messages before a time; those before the first tick get its time."""
        taken = [message for message in self._waiting if message.time_ns < limit_ns]
        self._waiting = [message for message in self._waiting if message.time_ns >= limit_ns]
        first_ns = min((m.time_ns for m in taken if m.time_ns != _BEFORE_FIRST_NS), default=0)
        yield from sorted(
            replace(m, time_ns=first_ns) if m.time_ns < first_ns else m for m in taken
        )


@dataclass
class SequenceCount:
    """Counts lost messages of a topic by their publication numbers.

    Each publisher numbers its messages one by one, but a message does not name its publisher. So
    every number is taken for the successor of the nearest smaller one: with one publisher that
    is exact, and with several the sum is, since it depends only on the last number of each.

    >>> count = SequenceCount()
    >>> for number in (1, 2, 5, 6):
    ...     count.add(number)
    >>> count.lost
    2

    Attributes:
        lost: Messages missing between those received.
    """

    lost: int = 0
    _last: list[int] = field(default_factory=list)

    def add(self, number: int, publishers: int = 1) -> None:
        """Count a received message by its number, from 1; `publishers` is how many are known."""
        nearest = max((last for last in self._last if last < number), default=0)
        missing = number - nearest - 1
        if not nearest or (missing and len(self._last) < publishers):
            self._last.append(number)
        else:
            self.lost += missing
            self._last[self._last.index(nearest)] = number
