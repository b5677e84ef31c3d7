"""Real-time clock of the simulation: ticks that follow the wall clock."""

from __future__ import annotations

from collections.abc import Callable
import time

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from goalreach_msgs_py.ros.acknowledgement import AcknowledgementGate
from goalreach_sim.pacing import Pacer

_SETTLE_S = 0.3


class RealtimeClock:
    """Calls a tick once in a period of the wall clock divided by the speed.

    Where the machine is too slow, ticks are given up rather than piled up, and every 5 s a
    warning says at which speed the simulation really runs.

    Args:
        node: The node whose executor serves the timer.
        period_ns: Simulated time between ticks.
        speed: Simulated seconds per wall second.
        tick: Advances and publishes.
        consumers: Names of the nodes whose registration the first tick waits for.
    """

    def __init__(
        self,
        node: Node,
        *,
        period_ns: int,
        speed: float,
        tick: Callable[[], object],
        consumers: tuple[str, ...],
    ) -> None:
        """Start the timer."""
        self._node = node
        self._period_s = period_ns * 1e-9
        self._tick = tick
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = None
        self._paused = False
        self._awaits_consumers = bool(consumers)
        self._absent_s = time.monotonic()
        self._gate = AcknowledgementGate(
            node, consumers, period_ns=period_ns, on_room=lambda: None
        )
        self.set_speed(speed)

    @property
    def paused(self) -> bool:
        """Whether ticks are withheld."""
        return self._paused

    @paused.setter
    def paused(self, value: bool) -> None:
        self._paused = value
        self._restart(self._pacer.speed)

    def set_speed(self, speed: float) -> None:
        """Go on at another speed."""
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
        self._restart(speed)
        self._timer = self._node.create_timer(
            self._pacer.interval_s, self._on_timer, clock=self._steady
        )

    def _restart(self, speed: float) -> None:
        self._pacer = Pacer(period_s=self._period_s, speed=speed, now_s=time.monotonic())

    def _await_consumers(self) -> None:
        now_s = time.monotonic()
        if self._gate.absent:
            self._absent_s = now_s
        if now_s - self._absent_s >= _SETTLE_S:
            self._awaits_consumers = False
            self._restart(self._pacer.speed)

    def _on_timer(self) -> None:
        if self._paused:
            return
        if self._awaits_consumers:
            self._await_consumers()
            return
        for _ in range(self._pacer.ticks_due(time.monotonic())):
            self._tick()
        self._report()

    def _report(self) -> None:
        real_speed = self._pacer.shortfall(time.monotonic())
        if real_speed is not None:
            self._node.get_logger().warning(
                f'too slow: {real_speed:.3g} times real time instead of {self._pacer.speed:g}'
            )
