"""Validation of commands: fresh ones, and from a single node."""

from dataclasses import dataclass
from typing import Final

from rclpy.node import Node

from goalreach_msgs_py.ros.messaging import InputReporter, resolved_name
from goalreach_msgs_py.topics import CLOCK, CMD_VEL

_THROTTLE_S: Final = 3.0
_LOOK_TICKS: Final = 5
_UNKNOWN: Final = '_UNKNOWN_'
"""Part of the name that ROS 2 gives to a node of which it knows only a publisher."""


@dataclass(kw_only=True)
class CommandGuard:
    """Refuses commands older than a limit, and all drive commands while two nodes drive.

    A command without a stamp counts as given now, like those of ROS 2 teleoperation nodes. One
    from the future is reported and accepted: the sender's clock is wrong, the command is fresh.
    Ages are by the graph's clock; `brakes_after_s` without a command the watchdog brakes. In
    lockstep the clock reports missing commands.
    """

    node: Node
    limit_s: float
    brakes_after_s: float
    reports_silence: bool

    def __post_init__(self) -> None:
        self._topic = resolved_name(self.node, CMD_VEL)
        self._reporter = InputReporter(self.node) if self.reports_silence else None
        self._now_ns: int | None = None
        self._accepted_ns: int | None = None
        self._moved = False
        self._ticks = 0
        self._drivers: list[str] = []

    def tick(self, stamp_ns: int, *, moving: bool) -> None:
        """Count a tick of the robot's clock; warn when the watchdog ends a motion."""
        self._now_ns = stamp_ns
        accepted_ns, limit_ns = self._accepted_ns, round(self.brakes_after_s * 1e9)
        if accepted_ns is not None and stamp_ns - accepted_ns > limit_ns:
            self._accepted_ns = None
            if moving or self._moved:
                line = f'{CMD_VEL}: nothing for {self.brakes_after_s:g} s: the watchdog brakes'
                self.node.get_logger().warning(line)
        self._moved = moving
        if self._reporter is not None:
            self._reporter.received(CLOCK, stamp_ns)
        self._ticks += 1
        if self._ticks % _LOOK_TICKS == 0:
            self._find_drivers()
        if len(self._drivers) > 1:
            self._warn_of_drivers()

    def _find_drivers(self) -> None:
        """Find the nodes that drive; one whose name is not known yet counts once it is."""
        self._drivers = []
        if self.node.count_publishers(self._topic) > 1:  # counting is cheap, names are not
            infos = self.node.get_publishers_info_by_topic(self._topic)
            names = {f'{info.node_namespace.rstrip("/")}/{info.node_name}' for info in infos}
            self._drivers = sorted(name for name in names if _UNKNOWN not in name)

    def accepts(self, topic: str, stamp_ns: int) -> bool:
        """Return whether to execute a command; a refusal is logged."""
        if topic == CMD_VEL and len(self._drivers) > 1:
            self._find_drivers()  # in lockstep no tick would come to do it
            if len(self._drivers) > 1:
                self._warn_of_drivers()
                return False
        if stamp_ns != 0 and self._now_ns is not None:
            if self._reporter is not None:
                self._reporter.received(topic, stamp_ns)
            age_ns = self._now_ns - stamp_ns
            if age_ns > round(self.limit_s * 1e9):
                self._warn(f'{topic}: a command {age_ns * 1e-9:.2f} s old is refused')
                return False
        if topic == CMD_VEL:
            self._accepted_ns = self._now_ns
        return True

    def age_s(self, stamp_ns: int) -> float:
        """Return the age of a command by the graph's clock, seconds; 0 without a stamp."""
        if stamp_ns == 0 or self._now_ns is None:
            return 0.0
        return max(0.0, (self._now_ns - stamp_ns) * 1e-9)

    def _warn_of_drivers(self) -> None:
        count = len(self._drivers)
        self._warn(f'{CMD_VEL}: {count} nodes drive: {self._drivers}; none is obeyed')

    def _warn(self, line: str) -> None:
        self.node.get_logger().warning(line, throttle_duration_sec=_THROTTLE_S)
