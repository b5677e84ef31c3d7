"""Joining messages of several topics by their stamp.

DDS keeps no order between topics, so a node acts on a stamp when all its inputs of that stamp
are there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


class StampSynchronizer:
    """Collects values by stamp and hands a complete set out once.

    Args:
        names: The inputs that make a set.
        depth: How many incomplete stamps are kept; the one that came first goes first, so that
            a stamp from the future keeps no place for long.

    >>> join = StampSynchronizer(['image', 'odom'])
    >>> join.add('image', 5, 'I')
    >>> join.add('odom', 5, 'O')
    {'image': 'I', 'odom': 'O'}

    Attributes:
        missing: How often each input was missing from a stamp that was given up, since the first
            complete set.
    """

    def __init__(self, names: Sequence[str], *, depth: int = 16) -> None:
        """Start with nothing collected."""
        self._names = tuple(names)
        self._depth = depth
        self._pending: dict[int, dict[str, Any]] = {}
        self._last_stamp_ns: int | None = None
        self.missing = dict.fromkeys(self._names, 0)

    @property
    def last_stamp_ns(self) -> int | None:
        """Stamp of the last complete set, or None before the first."""
        return self._last_stamp_ns

    def add(self, name: str, stamp_ns: int, value: object) -> Mapping[str, Any] | None:
        """Add one input; return the set when it is complete.

        Args:
            name: One of the names given at construction.
            stamp_ns: Stamp of the value, nanoseconds.
            value: The value.

        Returns:
            The complete set by name, or None. A stamp older than the last complete set is
            dropped; the stamp of the last complete set itself may be completed again (a sender
            that repeats itself, asking for the answer once more).

        Raises:
            KeyError: The name is not an input of this synchronizer.
        """
        if name not in self._names:
            raise KeyError(name)
        if self._last_stamp_ns is not None and stamp_ns < self._last_stamp_ns:
            return None
        collected = self._pending.setdefault(stamp_ns, {})
        collected[name] = value
        if len(collected) == len(self._names):
            del self._pending[stamp_ns]
            for older_ns in [s for s in self._pending if s < stamp_ns]:
                self._give_up(older_ns)
            self._last_stamp_ns = stamp_ns
            return collected
        if len(self._pending) > self._depth:
            self._give_up(next(iter(self._pending)))
        return None

    def _give_up(self, stamp_ns: int) -> None:
        there = self._pending.pop(stamp_ns)
        if self._last_stamp_ns is not None:
            for name in self._names:
                self.missing[name] += name not in there
