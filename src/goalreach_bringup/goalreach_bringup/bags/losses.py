"""Counting the messages of a topic that were published and never came."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ['SequenceCount']


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
