"""Which ticks are due on a clock that follows another, and how far it falls behind."""

import math

_BURST = 5
"""Maximum of consecutive ticks, so that commands are handled in between; chosen."""

_LATE_S = 0.25
"""Largest delay that is made up for, such as a short stall of the machine, s; chosen."""

REPORT_S = 5.0
"""Time over which the achieved speed is measured, s; chosen."""

_HOLDS = 0.98
"""Fraction of the requested speed that counts as reached; chosen."""


class Pacer:
    """Schedules ticks in real time: how many are due at a given time.

    A short delay is made up for, a few ticks at a time; ticks that are later than that are
    skipped. The class reads no clock: the time is an argument.

    Args:
        period_s: Simulated time between ticks.
        speed: Simulated seconds per second.
        now_s: The time now.
    """

    def __init__(self, *, period_s: float, speed: float, now_s: float) -> None:
        self.speed = speed
        self.interval_s = period_s / speed
        self._period_s = period_s
        self._due_s = self._reported_s = now_s
        self._ticks = 0

    def ticks_due(self, now_s: float) -> int:
        """Return how many ticks are due now.

        Args:
            now_s: The time now, not before that of the last call.
        """
        behind_s = now_s - self._due_s
        if behind_s < 0.0:
            return 0
        count = math.floor(behind_s / self.interval_s) + 1
        if behind_s > max(_LATE_S, _BURST * self.interval_s):
            self._due_s += (count - 1) * self.interval_s
            count = 1
        count = min(count, _BURST)
        self._ticks += count
        self._due_s += count * self.interval_s
        return count

    def shortfall(self, now_s: float) -> float | None:
        """Return the achieved speed, once in 5 s, if it is more than 2 % too low; else None.

        Args:
            now_s: The time now.
        """
        passed_s = now_s - self._reported_s
        if passed_s < REPORT_S:
            return None
        real_speed = self._ticks * self._period_s / passed_s
        self._reported_s = now_s
        self._ticks = 0
        return real_speed if real_speed < _HOLDS * self.speed else None
