"""When a recorded message is due again."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ['ReplayTimer']

_NS_PER_S = 1_000_000_000


@dataclass
class ReplayTimer:
    """Maps the time of a bag to the wall clock, at a rate, with pauses.

    >>> timer = ReplayTimer(rate=2.0)
    >>> timer.begin(now_s=10.0, at_ns=0)
    >>> timer.due_s(1_000_000_000)
    10.5

    Attributes:
        rate: Seconds of the bag per second of the wall clock.
        paused: Whether time stands still.
    """

    rate: float = 1.0
    paused: bool = False
    _now_s: float = field(default=0.0, init=False)
    _at_ns: float = field(default=0.0, init=False)

    def begin(self, *, now_s: float, at_ns: int) -> None:
        """Let a time of the bag be now."""
        self._now_s, self._at_ns = now_s, float(at_ns)

    def time_ns(self, now_s: float) -> int:
        """Return the time of the bag."""
        passed_s = 0.0 if self.paused else now_s - self._now_s
        return round(self._at_ns + passed_s * self.rate * _NS_PER_S)

    def due_s(self, time_ns: int) -> float:
        """Return when a time of the bag comes, if there is no pause before it."""
        return self._now_s + (time_ns - self._at_ns) / (self.rate * _NS_PER_S)

    def toggle(self, now_s: float) -> None:
        """Pause, or go on."""
        self._at_ns = float(self.time_ns(now_s))
        self._now_s = now_s
        self.paused = not self.paused

    def step_to(self, now_s: float, time_ns: int) -> None:
        """Jump to a time of the bag."""
        self._now_s, self._at_ns = now_s, float(time_ns)

    def change_rate(self, now_s: float, factor: float) -> None:
        """Go on at another rate."""
        self._at_ns = float(self.time_ns(now_s))
        self._now_s = now_s
        self.rate *= factor
