"""Which ticks are due on a clock that follows another, and how far it falls behind."""

from __future__ import annotations

from dataclasses import dataclass
import math

from goalreach_msgs_py.parameters import check_fields, parameter

_BURST = 5
"""Most ticks in a row: commands must get through in between; chosen."""

_LATE_S = 0.25
"""Lateness that is still made up for, such as a short stall of the machine, s; chosen."""

REPORT_S = 5.0
"""Time over which the real speed is measured, s; chosen."""

_HOLDS = 0.98
"""Share of its speed from which a clock holds it; chosen."""


class Pacer:
    """Says at a time how many ticks are due.

    A short delay is made up for, a few ticks at a time. What is later than that is given up
    rather than piled up. It reads no clock: the time is an argument.

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
        """Return how many ticks are to be done now.

        Args:
            now_s: The time now; never before the last.
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
        """Return at which speed the clock really ran, once in 5 s where that was 2 % too little.

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


@dataclass(frozen=True, kw_only=True)
class TimeConfig:
    """Clock, speed and seed of a simulation run."""

    clock: str = parameter(
        'realtime',
        'realtime: follow the wall clock; lockstep: wait for the commands of each image',
        choices=('realtime', 'lockstep'),
    )
    speed: float = parameter(
        1.0, 'Simulated seconds per wall second with clock realtime', minimum=0.01, maximum=100.0
    )
    seed: int = parameter(
        0, 'Seed of everything random in the simulation', minimum=0, maximum=2**31 - 1
    )
    start_time_ns: int = parameter(
        0,
        'Time at which the clock starts, ns; after a restart the clock must not go back',
        minimum=0,
        maximum=2**62,
    )
    answer_timeout_s: float = parameter(
        5.0,
        'Wall seconds after which a node that does not answer in lockstep is named',
        minimum=0.1,
        maximum=3600.0,
    )
    consumers: str = parameter(
        '',
        'Nodes that must miss no tick, separated by commas: the first tick waits until each has '
        'registered, and in lockstep none comes while one of them is too far behind',
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)

    @property
    def consumer_names(self) -> tuple[str, ...]:
        """The names in `consumers`."""
        return tuple(filter(None, (name.strip() for name in self.consumers.split(','))))
