"""Full garbage collections for processes that run for hours."""

from __future__ import annotations

import gc

__all__ = ['GarbageRounds']

_PERIOD_S = 10.0
"""Between full collections; chosen."""


class GarbageRounds:
    """A full collection now and then, for a loop that never has one of its own.

    Only a full collection gives back the tuples that Python keeps for reuse, up to 2000 of each
    length, and where all objects die by their reference counts none ever comes: over hours such a
    process gains some megabytes.

    Args:
        now_s: A clock that only goes forward.
    """

    def __init__(self, now_s: float) -> None:
        """Begin; what exists by now stays to the end and need not be looked through again."""
        gc.freeze()
        self._due_s = now_s + _PERIOD_S

    def look(self, now_s: float) -> None:
        """Collect where it is due; call it in every round of the loop."""
        if now_s < self._due_s:
            return
        gc.collect()
        self._due_s = now_s + _PERIOD_S
