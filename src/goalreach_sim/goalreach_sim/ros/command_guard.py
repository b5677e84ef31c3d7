"""Which commands the robot takes: fresh ones, and of one driver."""

from __future__ import annotations

from rclpy.node import Node

from goalreach_msgs_py.ros.input_watch import InputReporter
from goalreach_msgs_py.topics import CLOCK, CMD_VEL, HEAD_COMMAND

_THROTTLE_S = 3.0
_LOOK_TICKS = 5
_TOO_MANY = 2
_UNKNOWN = '_UNKNOWN_'
"""Part of the name that ROS 2 gives to a node of which it knows only that it sends."""


class CommandGuard:
    """Refuses commands that are old, and all of them while two nodes drive.

    A command without a stamp counts as given now, as drivers of ROS 2 do it. One from the future
    is told and taken: the clock of who drives is wrong, the command is fresh.

    Args:
        node: The robot's node.
        limit_s: Age from which a command is refused, seconds of the graph's clock.
        brakes_after_s: Time without a command after which the watchdog brakes, seconds.
        silence: Whether to tell that no command comes; in lockstep the clock does that.
    """

    def __init__(
        self, node: Node, *, limit_s: float, brakes_after_s: float, silence: bool
    ) -> None:
        """Start to look."""
        self._node = node
        self._topic = node.resolve_topic_name(CMD_VEL)  # counting knows of no remapping
        self._limit_ns = round(limit_s * 1e9)
        self._brakes_after_ns = round(brakes_after_s * 1e9)
        self._reporter = InputReporter(node, [CLOCK, CMD_VEL, HEAD_COMMAND]) if silence else None
        self._now_ns: int | None = None
        self._taken_ns: int | None = None
        self._moved = False
        self._ticks = 0
        self._drivers: list[str] = []

    def tick(self, stamp_ns: int, *, moving: bool) -> None:
        """Take note of a tick of the robot's clock; tell when the watchdog ends a motion."""
        self._now_ns = stamp_ns
        if self._taken_ns is not None and stamp_ns - self._taken_ns > self._brakes_after_ns:
            self._taken_ns = None
            if moving or self._moved:
                silent_s = self._brakes_after_ns * 1e-9
                line = f'{CMD_VEL}: nothing for {silent_s:g} s: the watchdog brakes'
                self._node.get_logger().warning(line)
        self._moved = moving
        if self._reporter is not None:
            self._reporter.heard(CLOCK, stamp_ns)
        self._ticks += 1
        if self._ticks % _LOOK_TICKS == 0:
            self._look()
        if len(self._drivers) >= _TOO_MANY:
            self._complain_of_drivers()

    def _complain_of_drivers(self) -> None:
        count = len(self._drivers)
        self._complain(f'{CMD_VEL}: {count} nodes drive: {self._drivers}; none is obeyed')

    def _look(self) -> None:
        """See who drives; a node whose name is not known yet counts once it is."""
        if self._node.count_publishers(self._topic) < _TOO_MANY:  # cheap, where names are not
            self._drivers = []
            return
        infos = self._node.get_publishers_info_by_topic(self._topic)
        names = {f'{info.node_namespace}{info.node_name}' for info in infos}
        self._drivers = sorted(name for name in names if _UNKNOWN not in name)

    def accepts(self, topic: str, stamp_ns: int) -> bool:
        """Return whether to take a command; a refusal is told.

        Args:
            topic: The command's topic.
            stamp_ns: The command's stamp.
        """
        if topic == CMD_VEL and len(self._drivers) >= _TOO_MANY:
            self._look()  # in lockstep no tick comes that would
            if len(self._drivers) >= _TOO_MANY:
                self._complain_of_drivers()
                return False
        if stamp_ns == 0 or self._now_ns is None:
            return self._take(topic)
        if self._reporter is not None:
            self._reporter.heard(topic, stamp_ns)
        age_ns = self._now_ns - stamp_ns
        if age_ns > self._limit_ns:
            self._complain(f'{topic}: a command {age_ns * 1e-9:.2f} s old is refused')
            return False
        return self._take(topic)

    def _take(self, topic: str) -> bool:
        if topic == CMD_VEL:
            self._taken_ns = self._now_ns
        return True

    def age_s(self, stamp_ns: int) -> float:
        """Return how old a command is by the graph's clock; 0 without a stamp."""
        if stamp_ns == 0 or self._now_ns is None:
            return 0.0
        return max(0.0, (self._now_ns - stamp_ns) * 1e-9)

    def _complain(self, line: str) -> None:
        self._node.get_logger().warning(line, throttle_duration_sec=_THROTTLE_S)
