"""Messages of a lockstep run in the order of its time, not of their arrival.

DDS keeps no order between topics, so two recordings of the same run differ in it. In lockstep the
graph's clock stands still between an image and its answer: everything that belongs to a stamp was
published, and received, at that time. Within one stamp the order is that of the topics' names.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

_KEPT: Final = 2
"""Ticks held back for what comes late. All that belongs to a tick has been published when the
next one is answered; the second is for messages that overtake others on their way."""


@dataclass(frozen=True, kw_only=True)
class TimedMessage:
    """A message with its receive time.

    Attributes:
        topic: Name of the topic.
        time_ns: Receive time in the graph's clock.
        data: The serialized message.
        arrival: Counts arrivals.
    """

    topic: str
    time_ns: int
    data: bytes
    arrival: int


@dataclass
class TickOrder:
    """Gathers messages, tells when a tick is complete, hands messages out in order.

    Attributes:
        required: Topics that each tick has exactly one message of.
        stamp_ns: The latest tick, or None before the first.
        repeats: Messages that came again, and were dropped.
    """

    required: Sequence[str]
    stamp_ns: int | None = None
    repeats: int = 0
    _missing: dict[int, set[str]] = field(default_factory=dict)
    _waiting: list[TimedMessage] = field(default_factory=list)
    _last: dict[str, bytes] = field(default_factory=dict)
    _arrivals: int = 0

    def add(self, topic: str, stamp_ns: int | None, data: bytes) -> bool:
        """Add a message.

        Args:
            topic: Its topic.
            stamp_ns: Its stamp, or None where it has none.
            data: The serialized message.

        Returns:
            Whether it was new; one that equals the last of its topic is a repetition.
        """
        if self._last.get(topic) == data:
            self.repeats += 1
            return False
        self._last[topic] = data
        if stamp_ns is not None and topic in self.required:
            self._note(topic, stamp_ns)
        time_ns = stamp_ns if stamp_ns is not None else self.stamp_ns
        self._arrivals += 1
        self._waiting.append(
            TimedMessage(
                topic=topic,
                time_ns=-1 if time_ns is None else time_ns,
                data=data,
                arrival=self._arrivals,
            )
        )
        return True

    def _note(self, topic: str, stamp_ns: int) -> None:
        """Cross a message off the list of its tick."""
        if self._missing and stamp_ns < min(self._missing):
            return
        self.stamp_ns = max(self.stamp_ns or 0, stamp_ns)
        self._missing.setdefault(stamp_ns, set(self.required)).discard(topic)

    @property
    def complete(self) -> bool:
        """Whether the latest tick is there with all that is required of it."""
        return self.stamp_ns is not None and not self._missing.get(self.stamp_ns)

    def settled(self) -> Iterator[TimedMessage]:
        """Yield, in order, the messages that nothing can come before any more."""
        ticks = sorted(self._missing)
        if not self.complete or len(ticks) <= _KEPT:
            return
        limit_ns = ticks[-_KEPT]
        self._missing = {stamp: self._missing[stamp] for stamp in ticks[-_KEPT:]}
        yield from self._take(limit_ns)

    def rest(self) -> Iterator[TimedMessage]:
        """Yield all that is left, in order."""
        yield from self._take(None)

    def _take(self, limit_ns: int | None) -> Iterator[TimedMessage]:
        taken = [m for m in self._waiting if limit_ns is None or m.time_ns < limit_ns]
        self._waiting = self._waiting if limit_ns is not None else []
        self._waiting = [m for m in self._waiting if m.time_ns >= (limit_ns or 0)]
        first_ns = min((m.time_ns for m in taken if m.time_ns >= 0), default=0)
        taken.sort(key=lambda m: (max(m.time_ns, first_ns), m.topic, self._rank(m)))
        for message in taken:
            early = message.time_ns < 0
            yield (
                message
                if not early
                else TimedMessage(
                    topic=message.topic,
                    time_ns=first_ns,
                    data=message.data,
                    arrival=message.arrival,
                )
            )

    def _rank(self, message: TimedMessage) -> tuple[bytes, int]:
        """Order messages of one topic and stamp: several publishers know no order but this."""
        return (message.data, message.arrival)


@dataclass
class SequenceCount:
    """Follows the publication numbers of a topic.

    Each publisher numbers its messages one by one, but a message does not say whose it is. So
    every number is taken for the successor of the nearest smaller one: with one publisher that
    is exact, and with several the sum is, since it depends only on where each one stands.

    >>> count = SequenceCount()
    >>> for number in (1, 2, 5, 6):
    ...     count.add(number)
    >>> count.lost
    2

    Attributes:
        lost: Messages missing between those that came.
    """

    lost: int = 0
    _last: list[int] = field(default_factory=list)

    def add(self, number: int, publishers: int = 1) -> None:
        """Note the number of a message that came.

        Args:
            number: Its publication number, from 1.
            publishers: Publishers of the topic, as far as known.
        """
        for index, last in enumerate(self._last):
            if last == number - 1:
                self._last[index] = number
                return
        smaller = [last for last in self._last if last < number]
        if number == 1 or not smaller or len(self._last) < publishers:
            self._last.append(number)
            return
        nearest = max(smaller)
        self.lost += number - nearest - 1
        self._last[self._last.index(nearest)] = number
