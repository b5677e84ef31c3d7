"""Clocks of the simulation: real time and lockstep, both behind the same methods."""

from collections.abc import Callable
import time
from typing import Final

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.node import Node

from goalreach_msgs_py.ros.acknowledgement import AcknowledgementGate
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, steady_timer, subscribe_raw
from goalreach_msgs_py.topics import (
    CMD_VEL,
    CONTROLLER,
    ESTIMATOR,
    HEAD_COMMAND,
    LOCALIZER,
    POSE,
    SENSORS,
    STATE,
    acknowledgement_topic,
)
from goalreach_sim.pacing import Pacer
from goalreach_sim.simulator_config import TimeConfig

_POLL_S: Final = 0.1
_SETTLE_S: Final = 0.3
"""How long the graph must have been complete before the first tick, since the two ends of a topic
discover each other one after the other; chosen."""
_REPEAT_S: Final = 1.0
_SUBSCRIBED: Final = (*SENSORS, POSE, STATE)
_PUBLISHED: Final = {
    HEAD_COMMAND: LOCALIZER,
    POSE: LOCALIZER,
    STATE: ESTIMATOR,
    CMD_VEL: CONTROLLER,
}
"""Topics of the loop that other nodes publish, and which node does."""


class RealtimeClock:
    """Ticks once in a period of the wall clock divided by the speed.

    Where the machine is too slow, ticks are skipped, and every 5 s a warning reports the achieved
    speed. The first tick waits until every consumer has registered.

    Args:
        node: The node whose executor serves the timer.
        timing: Speed and consumers.
        period_ns: Simulated time between ticks.
        tick: Advances and publishes.
    """

    def __init__(
        self, node: Node, timing: TimeConfig, *, period_ns: int, tick: Callable[[], object]
    ) -> None:
        self._node = node
        self._period_s = period_ns * 1e-9
        self._tick = tick
        self._timer = None
        self._paused = False
        self._awaits_consumers = bool(timing.consumer_names)
        self._absent_s = time.monotonic()
        self._gate = AcknowledgementGate(
            node, timing.consumer_names, period_ns=period_ns, on_room=lambda: None
        )
        self.set_speed(timing.speed)

    def pause(self, *, on: bool) -> None:
        """Withhold ticks, or continue."""
        self._paused = on
        self._restart(self._pacer.speed)

    def step(self) -> bool:
        """Tick once where paused and begun; return whether it did."""
        if not self._paused or self._awaits_consumers:
            return False
        self._tick()
        return True

    def set_speed(self, speed: float) -> None:
        """Continue at another speed, simulated seconds per wall second."""
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
        self._restart(speed)
        self._timer = steady_timer(self._node, self._pacer.interval_s, self._on_timer)

    def accepts(self, _topic: str, _stamp_ns: int) -> bool:
        """Return whether a command may be taken: in real time always."""
        return True

    def answered(self, _topic: str) -> None:
        """Count an accepted command, for which this clock does not wait."""

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
        speed = self._pacer.shortfall(time.monotonic())
        if speed is not None:
            self._node.get_logger().warning(
                f'too slow: {speed:.3g} times real time instead of {self._pacer.speed:g}'
            )


class LockstepClock:
    """Ticks when `/cmd_vel` and `/head/command` of the last stamp have arrived.

    The first tick waits until every topic of the loop has both ends and every consumer has
    registered. Later ticks also wait while the window of a consumer is full. After one second
    without an answer the last tick is sent again; after the time limit the node that does not
    answer is named.

    Args:
        node: The node whose executor serves the timer.
        timing: Time limit for answers, and consumers.
        period_ns: Simulated time between two ticks.
        tick: Advances and publishes; returns the new stamp, nanoseconds.
        repeat: Sends the last tick again.
    """

    def __init__(
        self,
        node: Node,
        timing: TimeConfig,
        *,
        period_ns: int,
        tick: Callable[[], int],
        repeat: Callable[[], None],
    ) -> None:
        self._node = node
        self._timeout_s = timing.answer_timeout_s
        self._tick = tick
        self._repeat = repeat
        self._stamp_ns: int | None = None
        self._missing: set[str] = set()
        self._answered_ns: dict[str, int] = {}
        self._paused = False
        self._changed_s = self._ticked_s = self._named_s = time.monotonic()
        self._gate = AcknowledgementGate(
            node, timing.consumer_names, period_ns=period_ns, on_room=self._step_if_answered
        )
        steady_timer(node, _POLL_S, self._on_timer)

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
        self._missing = {CMD_VEL, HEAD_COMMAND}
        self._ticked_s = self._named_s = time.monotonic()
        self._stamp_ns = self._tick()
        self._gate.ticked(self._stamp_ns)

    def _on_timer(self) -> None:
        now_s = time.monotonic()
        self._gate.forget_lost()
        if self._stamp_ns is None:
            self._await_graph(now_s)
        elif not self._paused and now_s - self._ticked_s > _REPEAT_S:
            self._follow_chain()
            self._repeat()
            if now_s - self._named_s > self._timeout_s:
                self._name_silent(now_s)

    def _await_graph(self, now_s: float) -> None:
        named = self._node.resolve_topic_name  # counting knows of no remapping
        count = self._node.count_publishers
        absent = {node for t, node in _PUBLISHED.items() if not count(named(t))}
        absent.update(self._gate.absent)
        unheard = [t for t in _SUBSCRIBED if not self._node.count_subscribers(named(t))]
        if absent or unheard:
            self._changed_s = now_s
            if now_s - self._named_s > self._timeout_s:
                self._named_s = now_s
                missing = ', '.join(sorted(absent) or unheard)
                self._node.get_logger().warning(f'lockstep waits for {missing}')
        elif now_s - self._changed_s > _SETTLE_S and not self._paused:
            self._step()

    def _follow_chain(self) -> None:
        """Subscribe to what lies between image and command, once an answer is overdue."""
        if self._answered_ns:
            return
        self._answered_ns = {POSE: 0, STATE: 0}

        for message_type, topic in ((PoseWithCovarianceStamped, POSE), (DiagnosticArray, STATE)):

            def note(stamp_ns: int, _raw: bytes, topic: str = topic) -> None:
                self._answered_ns[topic] = stamp_ns

            subscribe_raw(self._node, message_type, topic, note, RELIABLE_QOS)

    def _name_silent(self, now_s: float) -> None:
        self._named_s = now_s
        blocking = self._gate.blocking
        if not self._missing and blocking:
            node, topic = blocking[0], acknowledgement_topic(blocking[0])
        else:
            topic = self._first_unanswered()
            node = _PUBLISHED[topic]
        waited_s = now_s - self._ticked_s
        self._node.get_logger().error(f'{node} did not answer on {topic} for {waited_s:.0f} s')

    def _first_unanswered(self) -> str:
        """Return the first topic of the chain from image to command without the last stamp."""
        if HEAD_COMMAND in self._missing:
            return HEAD_COMMAND
        chain = (t for t in (POSE, STATE) if self._answered_ns.get(t) != self._stamp_ns)
        return next(chain, CMD_VEL)
