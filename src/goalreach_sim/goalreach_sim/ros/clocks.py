"""Clocks of the simulation: real time and lockstep, both behind the same methods."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
import math
import time
from typing import Final

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.node import Node
from rclpy.timer import Timer

from goalreach_msgs_py import topics
from goalreach_msgs_py.ros.acknowledgement import AcknowledgementGate
from goalreach_msgs_py.ros.messaging import (
    RELIABLE_QOS,
    resolved_name,
    steady_timer,
    subscribe_raw,
)
from goalreach_sim.simulator_config import TimeConfig

_POLL_S: Final = 0.1
_SETTLE_S: Final = 0.3
"""How long the graph must have been complete before the first tick, since the two ends of a topic
discover each other one after the other; chosen."""
_REPEAT_S: Final = 1.0
_SUBSCRIBED: Final = (*topics.SENSORS, topics.POSE, topics.STATE)
_PUBLISHED: Final = {
    topics.HEAD_COMMAND: topics.LOCALIZER,
    topics.POSE: topics.LOCALIZER,
    topics.STATE: topics.ESTIMATOR,
    topics.CMD_VEL: topics.CONTROLLER,
}
"""Topics of the loop that other nodes publish, and which node does."""
_BURST: Final = 5
"""Maximum of consecutive ticks, so that commands are handled in between; chosen."""
_LATE_S: Final = 0.25
"""Largest delay that is made up for, such as a short stall of the machine, s; chosen."""
_REPORT_S: Final = 5.0
"""Time over which the achieved speed is measured, s; chosen."""
_HOLDS: Final = 0.98
"""Fraction of the requested speed that counts as reached; chosen."""


class Pacer:
    """Schedules ticks: how many are due at a given time, at `speed` simulated seconds per second.

    A short delay is made up for, a few ticks at a time; ticks that are later than that are
    skipped. The class reads no clock: the time is an argument.
    """

    def __init__(self, *, period_s: float, speed: float, now_s: float) -> None:
        self.speed = speed
        self.interval_s = period_s / speed
        self._period_s = period_s
        self._due_s = self._reported_s = now_s
        self._ticks = 0

    def ticks_due(self, now_s: float) -> int:
        """Return how many ticks are due now."""
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
        """Return the achieved speed, once in 5 s, if it is more than 2 % too low; else None."""
        passed_s = now_s - self._reported_s
        if passed_s < _REPORT_S:
            return None
        real_speed = self._ticks * self._period_s / passed_s
        self._reported_s = now_s
        self._ticks = 0
        return real_speed if real_speed < _HOLDS * self.speed else None


@dataclass(kw_only=True)
class RealtimeClock:
    """Ticks once in a period of the wall clock divided by the speed.

    Where the machine is too slow, ticks are skipped, and every 5 s a warning reports the achieved
    speed. The first tick waits until every consumer has registered.
    """

    node: Node
    timing: TimeConfig
    period_ns: int
    tick: Callable[[], object]

    def __post_init__(self) -> None:
        self._timer: Timer | None = None
        self._paused = False
        consumers = self.timing.consumer_names
        self._awaits_consumers = bool(consumers)
        self._absent_s = self._named_s = time.monotonic()
        self._gate = AcknowledgementGate(
            self.node, consumers, period_ns=self.period_ns, on_room=lambda: None
        )
        self.set_speed(self.timing.speed)

    def pause(self, *, on: bool) -> None:
        """Withhold ticks, or continue."""
        self._paused = on
        self._restart(self._pacer.speed)

    def step(self) -> bool:
        """Tick once where paused and begun; return whether it did."""
        if not self._paused or self._awaits_consumers:
            return False
        self.tick()
        return True

    def set_speed(self, speed: float) -> None:
        """Continue at another speed, simulated seconds per wall second."""
        if self._timer is not None:
            self.node.destroy_timer(self._timer)
        self._restart(speed)
        self._timer = steady_timer(self.node, self._pacer.interval_s, self._on_timer)

    def accepts(self, _topic: str, _stamp_ns: int) -> bool:
        """Return whether a command may be taken: in real time always."""
        return True

    def answered(self, _topic: str) -> None:
        """Count an accepted command, for which this clock does not wait."""

    def _restart(self, speed: float) -> None:
        period_s = self.period_ns * 1e-9
        self._pacer = Pacer(period_s=period_s, speed=speed, now_s=time.monotonic())

    def _await_consumers(self) -> None:
        now_s = time.monotonic()
        if absent := self._gate.absent:
            self._absent_s = now_s
            if now_s - self._named_s > self.timing.answer_timeout_s:
                self._named_s = now_s
                self.node.get_logger().warning(f'waits for {", ".join(sorted(absent))}')
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
            self.tick()
        speed = self._pacer.shortfall(time.monotonic())
        if speed is not None:
            line = f'too slow: {speed:.3g} times real time instead of {self._pacer.speed:g}'
            self.node.get_logger().warning(line)


@dataclass(kw_only=True)
class LockstepClock:
    """Ticks when `/cmd_vel` and `/head/command` of the last stamp have arrived.

    The first tick waits until every topic of the loop has both ends and every consumer has
    registered. Later ticks also wait while the window of a consumer is full. After one second
    without an answer the last tick is sent again; after the time limit the node that does not
    answer is named.
    """

    node: Node
    timing: TimeConfig
    period_ns: int
    tick: Callable[[], int]
    """Advances and publishes; returns the new stamp, nanoseconds."""
    repeat: Callable[[], None]

    def __post_init__(self) -> None:
        self._stamp_ns: int | None = None
        self._missing: set[str] = set()
        self._answered_ns: dict[str, int] = {}
        self._paused = False
        self._changed_s = self._ticked_s = self._named_s = time.monotonic()
        names, on_room = self.timing.consumer_names, self._step_if_answered
        self._gate = AcknowledgementGate(
            self.node, names, period_ns=self.period_ns, on_room=on_room
        )
        steady_timer(self.node, _POLL_S, self._on_timer)

    def pause(self, *, on: bool) -> None:
        """Withhold ticks, or continue."""
        self._paused = on
        self._step_if_answered()

    def step(self) -> bool:
        """Tick once where paused and the last tick is answered; return whether it did."""
        waits = self._stamp_ns is None or self._missing or self._gate.blocking
        if not self._paused or waits:
            return False
        self._step()
        return True

    def set_speed(self, _speed: float) -> None:
        """Ignore the speed: lockstep is as fast as the graph answers."""

    def accepts(self, topic: str, stamp_ns: int) -> bool:
        """Return whether a command is an answer to the last tick, and the first on its topic."""
        return stamp_ns == self._stamp_ns and topic in self._missing

    def answered(self, topic: str) -> None:
        """Count an accepted command; tick when it was the last one missing."""
        self._missing.discard(topic)
        self._step_if_answered()

    def _step_if_answered(self) -> None:
        waits = self._missing or self._paused or self._gate.blocking
        if self._stamp_ns is not None and not waits:
            self._step()

    def _step(self) -> None:
        self._missing = {topics.CMD_VEL, topics.HEAD_COMMAND}
        self._ticked_s = self._named_s = time.monotonic()
        self._stamp_ns = self.tick()
        self._gate.ticked(self._stamp_ns)

    def _on_timer(self) -> None:
        now_s = time.monotonic()
        self._gate.forget_lost()
        if self._stamp_ns is None:
            self._await_graph(now_s)
        elif (self._missing or not self._paused) and now_s - self._ticked_s > _REPEAT_S:
            self._follow_chain()
            self.repeat()
            if now_s - self._named_s > self.timing.answer_timeout_s:
                self._name_silent(now_s)

    def _await_graph(self, now_s: float) -> None:
        named = partial(resolved_name, self.node)
        count = self.node.count_publishers
        absent = {node for t, node in _PUBLISHED.items() if not count(named(t))}
        absent.update(self._gate.absent)
        unheard = [t for t in _SUBSCRIBED if not self.node.count_subscribers(named(t))]
        if absent or unheard:
            self._changed_s = now_s
            if now_s - self._named_s > self.timing.answer_timeout_s:
                self._named_s = now_s
                missing = ', '.join(sorted(absent) or unheard)
                self.node.get_logger().warning(f'lockstep waits for {missing}')
        elif now_s - self._changed_s > _SETTLE_S and not self._paused:
            self._step()

    def _follow_chain(self) -> None:
        """Subscribe to what lies between image and command, once an answer is overdue."""
        if self._answered_ns:
            return
        self._answered_ns = {topics.POSE: 0, topics.STATE: 0}
        types = (PoseWithCovarianceStamped, DiagnosticArray)
        for message_type, topic in zip(types, self._answered_ns, strict=True):

            def note(stamp_ns: int, _raw: bytes, topic: str = topic) -> None:
                self._answered_ns[topic] = stamp_ns

            subscribe_raw(self.node, message_type, topic, note, RELIABLE_QOS)

    def _name_silent(self, now_s: float) -> None:
        self._named_s = now_s
        blocking = self._gate.blocking
        if not self._missing and blocking:
            node, topic = blocking[0], f'/{topics.acknowledgement_topic(blocking[0])}'
        else:
            topic = self._first_unanswered()
            node = _PUBLISHED[topic]
        waited_s = now_s - self._ticked_s
        self.node.get_logger().error(f'{node} did not answer on {topic} for {waited_s:.0f} s')

    def _first_unanswered(self) -> str:
        """Return the first topic of the chain from image to command without the last stamp."""
        if topics.HEAD_COMMAND in self._missing:
            return topics.HEAD_COMMAND
        unanswered = (t for t, ns in self._answered_ns.items() if ns != self._stamp_ns)
        return next(unanswered, topics.CMD_VEL)
