"""Lockstep clock of the simulation: a tick only when the last image has been answered."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import time
from typing import Final

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import Header

from goalreach_msgs_py.ros.common_messages import stamp_from_msg
from goalreach_msgs_py.ros.subscribe_raw import RELIABLE_QOS
from goalreach_msgs_py.topics import (
    BUMPERS,
    CAMERA_INFO,
    CMD_VEL,
    HEAD_COMMAND,
    IMAGE,
    JOINT_STATES,
    JUDGED,
    ODOM,
    POSE,
    RECORDED,
    STATE,
)

_MOST_TICKS: Final = 100
"""Chosen: half of what the judge's queues hold, so that none is lost; it hardly ever counts, since
judging a tick costs less than making it."""


class JudgeWindow:
    """Counts the ticks that the judge has not heard yet.

    Subscribes: `/_judged`, the stamp of the last tick heard, every few ticks.

    Args:
        node: The node that ticks.
        judged: Whether a judge belongs to the run.
        on_room: Called when there is room again.
    """

    def __init__(self, node: Node, *, judged: bool, on_room: Callable[[], None]) -> None:
        """Listen."""
        self._node = node
        self._on_room = on_room
        self._ahead: deque[int] = deque()
        self._judged = judged
        self._seen = False
        if judged:
            node.create_subscription(Header, JUDGED, self._on_judged, RELIABLE_QOS)

    @property
    def full(self) -> bool:
        """Whether to wait for the judge."""
        return self._judged and len(self._ahead) >= _MOST_TICKS

    def ticked(self, stamp_ns: int) -> None:
        """Note a tick."""
        if self._judged:
            self._ahead.append(stamp_ns)

    def look(self) -> None:
        """Go on without a judge that has gone."""
        there = self._node.count_publishers(JUDGED) > 0
        self._seen = self._seen or there
        if self._judged and self._seen and not there:
            self._node.get_logger().info('the judge has gone; the run goes on without it')
            self._judged = False
            self._on_room()

    def _on_judged(self, message: Header) -> None:
        waited = self.full
        stamp_ns = stamp_from_msg(message.stamp)
        while self._ahead and self._ahead[0] <= stamp_ns:
            self._ahead.popleft()
        if waited and not self.full:
            self._on_room()


_POLL_S = 0.1
_SETTLE_S = 0.3
_REPEAT_S = 1.0
_HEARD = (IMAGE, CAMERA_INFO, JOINT_STATES, ODOM, BUMPERS, POSE, STATE)
_SPOKEN = (HEAD_COMMAND, POSE, STATE, CMD_VEL)
_ANSWER_OF = {
    HEAD_COMMAND: 'landmark_localizer',
    POSE: 'landmark_localizer',
    STATE: 'state_estimator',
    CMD_VEL: 'goal_reaching_controller',
    RECORDED: 'recorder',
    JUDGED: 'the judge',
}


class LockstepClock:
    """Ticks when `/cmd_vel` and `/head/command` of the last stamp have arrived.

    The first tick waits until every topic of the loop has both ends. Silence of one second makes
    the last tick be sent again; after the time limit the node that does not answer is named.
    A run that is recorded waits for the recorder's `/_recorded` too, so that nothing is lost; a
    recorder that has gone is not waited for.

    Args:
        node: The node whose executor serves the timer.
        timeout_s: Wall seconds until a silent node is named.
        recorded: Whether a recorder belongs to the run.
        judged: Whether somebody judges the run; see `JudgeWindow`.
        tick: Advances and publishes; returns the new stamp, nanoseconds.
        repeat: Sends the last tick again.
    """

    def __init__(
        self,
        node: Node,
        *,
        timeout_s: float,
        recorded: bool,
        judged: bool = False,
        tick: Callable[[], int],
        repeat: Callable[[], None],
    ) -> None:
        """Start to wait for the graph."""
        self._node = node
        self._timeout_s = timeout_s
        self._tick = tick
        self._repeat = repeat
        self._answers = {CMD_VEL, HEAD_COMMAND} | ({RECORDED} if recorded else set())
        self._stamp_ns: int | None = None
        self._missing: set[str] = set()
        self._heard: dict[str, int] = {}
        self._listening = False
        self._paused = False
        self._changed_s = self._ticked_s = self._named_s = time.monotonic()
        self._window = JudgeWindow(node, judged=judged, on_room=self._step_if_answered)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        if recorded:
            node.create_subscription(Header, RECORDED, self._on_recorded, RELIABLE_QOS)
        node.create_timer(_POLL_S, self._on_timer, clock=steady)

    @property
    def paused(self) -> bool:
        """Whether ticks are withheld."""
        return self._paused

    @paused.setter
    def paused(self, value: bool) -> None:
        self._paused = value
        self._step_if_answered()

    def accepts(self, topic: str, stamp_ns: int) -> bool:
        """Return whether a command is the awaited answer; what is older or doubled is not."""
        return stamp_ns == self._stamp_ns and topic in self._missing

    def answered(self, topic: str) -> None:
        """Note an accepted command; tick when it was the last one missing."""
        self._missing.discard(topic)
        self._step_if_answered()

    def _step_if_answered(self) -> None:
        waits = self._missing or self._paused or self._window.full
        if self._stamp_ns is not None and not waits:
            self._step()

    def _step(self) -> None:
        self._missing = set(self._answers)
        self._ticked_s = self._named_s = time.monotonic()
        self._stamp_ns = self._tick()
        self._window.ticked(self._stamp_ns)

    def _on_timer(self) -> None:
        now_s = time.monotonic()
        self._forget_recorder()
        self._window.look()
        if self._stamp_ns is None:
            self._await_graph(now_s)
        elif not self._paused and now_s - self._ticked_s > _REPEAT_S:
            self._listen()
            self._repeat()
            if now_s - self._named_s > self._timeout_s:
                self._name_silent(now_s)

    def _await_graph(self, now_s: float) -> None:
        spoken = {*_SPOKEN, *self._answers}
        named = self._node.resolve_topic_name  # counting knows of no remapping
        silent = [t for t in spoken if not self._node.count_publishers(named(t))]
        deaf = [t for t in _HEARD if not self._node.count_subscribers(named(t))]
        if silent or deaf:
            self._changed_s = now_s
            if now_s - self._named_s > self._timeout_s:
                self._named_s = now_s
                who = ', '.join(sorted({_ANSWER_OF[t] for t in silent})) or ', '.join(deaf)
                self._node.get_logger().warning(f'lockstep waits for {who}')
        elif now_s - self._changed_s > _SETTLE_S and not self._paused:
            self._step()

    def _on_recorded(self, message: Header) -> None:
        if self.accepts(RECORDED, stamp_from_msg(message.stamp)):
            self.answered(RECORDED)

    def _forget_recorder(self) -> None:
        """Go on without a recorder that has gone."""
        waited = self._stamp_ns is not None and RECORDED in self._missing
        if waited and not self._node.count_publishers(RECORDED):
            self._node.get_logger().info('the recorder has gone; the run goes on without it')
            self._answers.discard(RECORDED)
            self.answered(RECORDED)

    def _listen(self) -> None:
        """Follow the chain between image and command, only once there is silence."""
        if self._listening:
            return
        self._listening = True

        def note_pose(message: PoseWithCovarianceStamped) -> None:
            self._heard[POSE] = stamp_from_msg(message.header.stamp)

        def note_state(message: DiagnosticArray) -> None:
            self._heard[STATE] = stamp_from_msg(message.header.stamp)

        create = self._node.create_subscription
        create(PoseWithCovarianceStamped, POSE, note_pose, RELIABLE_QOS)
        create(DiagnosticArray, STATE, note_state, RELIABLE_QOS)

    def _name_silent(self, now_s: float) -> None:
        self._named_s = now_s
        if not self._missing:
            silent = JUDGED
        elif self._missing == {RECORDED}:
            silent = RECORDED
        elif HEAD_COMMAND in self._missing:
            silent = HEAD_COMMAND
        else:
            chain = [t for t in (POSE, STATE) if self._heard.get(t) != self._stamp_ns]
            silent = chain[0] if chain else CMD_VEL
        waited_s = now_s - self._ticked_s
        self._node.get_logger().error(
            f'{_ANSWER_OF[silent]} did not answer on {silent} for {waited_s:.0f} s'
        )
