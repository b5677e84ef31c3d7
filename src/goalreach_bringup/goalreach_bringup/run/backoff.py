"""When to start a dead process again, and when to give it up."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ['Backoff']


@dataclass
class Backoff:
    """Counts the deaths of one process and spaces its restarts out.

    Attributes:
        first_delay_s: Wait before the second restart, after none before the first; each further
            one waits twice as long.
        limit: Deaths within the window after which it is given up.
        window_s: Deaths longer ago than this are forgiven.
    """

    first_delay_s: float = 0.2
    limit: int = 5
    window_s: float = 60.0
    _deaths_s: list[float] = field(default_factory=list)

    def died(self, now_s: float) -> float | None:
        """Note a death; return how long to wait before the restart, or None to give up.

        Args:
            now_s: Time of the death on any steady clock, seconds.
        """
        self._deaths_s = [t for t in self._deaths_s if now_s - t < self.window_s] + [now_s]
        if len(self._deaths_s) >= self.limit:
            return None
        before = len(self._deaths_s) - 1
        return float(self.first_delay_s * 2.0 ** (before - 1)) if before else 0.0
