"""Real-time clock of the simulation: ticks that follow the wall clock."""

from __future__ import annotations

from collections.abc import Callable
import time

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from goalreach_msgs_py.topics import RECORDED

__all__ = ['RealtimeClock']

_LATE_TICKS = 5
_REPORT_S = 5.0
_SETTLE_S = 0.3


class RealtimeClock:
    """Calls a tick once in a period of the wall clock divided by the speed.

    Where the machine is too slow, ticks are given up rather than piled up, and every 5 s a
    warning says at which speed the simulation really runs.

    Args:
        node: The node whose executor serves the timer.
        period_s: Simulated time between ticks.
        speed: Simulated seconds per wall second.
        tick: What to do.
        recorded: Whether to wait for a recorder, until it is there.
    """

    def __init__(
        self,
        node: Node,
        *,
        period_s: float,
        speed: float,
        tick: Callable[[], object],
        recorded: bool,
    ) -> None:
        """Start the timer."""
        self._node = node
        self._period_s = period_s
        self._tick = tick
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = None
        self.paused = False
        self._awaits_recorder = recorded
        self._absent_s = time.monotonic()
        self.set_speed(speed)

    def set_speed(self, speed: float) -> None:
        """Go on at another speed."""
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
        self._speed = speed
        self._interval_s = self._period_s / speed
        self._restart()
        self._timer = self._node.create_timer(self._interval_s, self._on_timer, clock=self._steady)

    def _restart(self) -> None:
        self._due_s = self._reported_s = time.monotonic()
        self._ticks = self._given_up = 0

    def _on_timer(self) -> None:
        if self.paused or self._waits():
            self._restart()
            return
        now_s = time.monotonic()
        late = int((now_s - self._due_s) / self._interval_s) + 1
        if late > _LATE_TICKS:
            self._given_up += late - 1
            self._due_s += (late - 1) * self._interval_s
            late = 1
        for _ in range(late):
            self._tick()
            self._ticks += 1
            self._due_s += self._interval_s
        if now_s - self._reported_s >= _REPORT_S:
            self._report(now_s)

    def _waits(self) -> bool:
        if self._awaits_recorder:
            now_s = time.monotonic()
            if not self._node.count_publishers(RECORDED):
                self._absent_s = now_s
            self._awaits_recorder = now_s - self._absent_s < _SETTLE_S
        return self._awaits_recorder

    def _report(self, now_s: float) -> None:
        if self._given_up:
            real = self._ticks * self._period_s / (now_s - self._reported_s)
            self._node.get_logger().warning(
                f'too slow: {real:.2f} times real time instead of {self._speed:g}'
            )
        self._ticks = self._given_up = 0
        self._reported_s = now_s
