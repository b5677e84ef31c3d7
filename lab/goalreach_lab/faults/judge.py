"""What came of a fault, from what was seen of the robot before, while and after it lasted."""

from __future__ import annotations

from collections import deque
from dataclasses import asdict, dataclass
import math
import re
from typing import Any, Final, TypeAlias

from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.values import Confidence, Odometry, RegionState, Twist2

Moment: TypeAlias = tuple[int, float]
"""A moment by the graph's clock, nanoseconds, and by the wall's, seconds."""


GOOD_POSE_M: Final = 6.0 * INCH_M
"""A pose that is believed and farther off than this is wrong."""

_FRESH_S: Final = 0.2
_HEALTHY_TICKS: Final = 10
"""More ticks than a command stays fresh: a chain that has just broken is not healthy. Chosen."""

_TOUCH_M: Final = 1e-4
_KEPT: Final = 4000
_MOVES: Final = 0.01


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What came of one fault.

    Attributes:
        kind: Name of the kind.
        bumps: Times the robot ran into a wall from the fault's beginning to the recovery.
        wrong: States believed good whose position was off by more than 6 in.
        worst_m: Largest error of a state believed good.
        recovery_s: Seconds from the fault's end to sound driving, of the graph's clock or of the
            wall's, whichever is more; None where that did not come: a hang.
        report: The line that named the fault, or an empty text.
        moment_s: When it began, seconds of the graph's clock.
        path_ended: Whether a path ended meanwhile: then the time holds the way to the next
            start and the search there, which are no part of the fault.
    """

    kind: str
    bumps: int
    wrong: int
    worst_m: float
    recovery_s: float | None
    report: str
    moment_s: float
    path_ended: bool = False

    def to_json(self) -> dict[str, Any]:
        """Return it as plain values."""
        return asdict(self)


class Record:
    """What is seen of a running stack, and what it says.

    Args:
        arena: Where the robot drives.

    Attributes:
        clock_ns: The last tick of the graph's clock.
        paths_ended: Paths that ended since the beginning.
        sent_ns: When ticks were sent, by the system's clock, where that is known.
        lines: What nodes and launcher said since the beginning.
    """

    def __init__(self, arena: Arena) -> None:
        self._arena = arena
        self._truth: dict[int, Odometry] = {}
        self._order: deque[int] = deque()
        self._touching = False
        self._healthy = 0
        self._good_ns = self._command_ns = 0
        self._sound: Moment = (0, 0.0)
        self._moving = False
        self.clock_ns = 0
        self.sent_ns: dict[int, int] = {}
        self.lines: deque[str] = deque(maxlen=_KEPT)
        self.begin()

    def begin(self) -> None:
        """Count from now on."""
        self.bumps = self.wrong = self.paths_ended = 0
        self.worst_m = 0.0
        self.healthy_since: Moment | None = None
        self.lines.clear()

    def end(self) -> None:
        """Look for sound driving from now on: the fault is over."""
        self._healthy = 0
        self.healthy_since = None

    def clock_at(self, wall_ns: int) -> int:
        """Return the graph's clock at a moment of the past: the last tick sent by then.

        Args:
            wall_ns: The moment by the system's clock, nanoseconds.
        """
        sent = ((sent_ns, s) for s, sent_ns in self.sent_ns.items() if sent_ns <= wall_ns)
        return max(sent, default=(0, 0))[1]

    @property
    def clock_s(self) -> float:
        """The graph's clock."""
        return self.clock_ns * 1e-9

    @property
    def speed_m_per_s(self) -> float:
        """The robot's true speed."""
        truth = self._truth.get(self.clock_ns)
        return 0.0 if truth is None else abs(truth.twist.linear_m_per_s)

    @property
    def y_m(self) -> float:
        """How far the robot truly is from the goal wall."""
        truth = self._truth.get(self.clock_ns)
        return 0.0 if truth is None else truth.pose.y_m

    def truth(self, stamp_ns: int, truth: Odometry, *, wall_s: float) -> None:
        """Take note of where the robot is: the tick of the graph's clock.

        Args:
            stamp_ns: The tick.
            truth: Where it is.
            wall_s: The time now on the wall's steady clock.
        """
        self.clock_ns = stamp_ns
        if stamp_ns not in self._truth:
            self._order.append(stamp_ns)
        self._truth[stamp_ns] = truth
        if len(self._order) > _KEPT:
            oldest_ns = self._order.popleft()
            del self._truth[oldest_ns]
            self.sent_ns.pop(oldest_ns, None)
        touching = self._touches(truth)
        self.bumps += touching and not self._touching
        self._touching = touching
        fresh_ns = stamp_ns - round(_FRESH_S * 1e9)
        sound = self._moving and fresh_ns <= self._good_ns <= stamp_ns
        sound = sound and fresh_ns <= self._command_ns <= stamp_ns
        self._healthy = self._healthy + 1 if sound else 0
        if self._healthy == 1:
            self._sound = (stamp_ns, wall_s)
        self.healthy_since = self._sound if self._healthy >= _HEALTHY_TICKS else None

    def _touches(self, truth: Odometry) -> bool:
        pose, radius_m = truth.pose, BODY_RADIUS_M + _TOUCH_M
        inside_x = radius_m <= pose.x_m <= self._arena.width_m - radius_m
        return not (inside_x and radius_m <= pose.y_m <= self._arena.length_m - radius_m)

    def state(self, stamp_ns: int, state: RegionState) -> None:
        """Take note of what is believed."""
        truth = self._truth.get(stamp_ns)
        if state.confidence is not Confidence.OK or truth is None:
            return
        error_m = math.hypot(state.pose.x_m - truth.pose.x_m, state.pose.y_m - truth.pose.y_m)
        self.worst_m = max(self.worst_m, error_m)
        if error_m > GOOD_POSE_M:
            self.wrong += 1
        else:
            self._good_ns = stamp_ns

    def command(self, stamp_ns: int, command: Twist2) -> None:
        """Take note of a command that reached the robot."""
        self._command_ns = stamp_ns
        speed, rate = command.linear_m_per_s, command.steering_rad_per_s
        self._moving = abs(speed) > _MOVES or abs(rate) > _MOVES

    def verdict(
        self,
        kind: str,
        named: str,
        *,
        began_ns: int,
        ended: Moment,
        sound: Moment | None,
        speed: float = 1.0,
    ) -> Verdict:
        """Return what came of a fault.

        Args:
            kind: Its name.
            named: Regular expression of the words that name it.
            began_ns: When it began.
            ended: When it ended.
            sound: From when on the robot drove soundly again, or None where it did not.
            speed: Seconds of the graph's clock in one of the wall's.
        """
        recovery_s = None
        if sound is not None:
            by_graph_s = (sound[0] - ended[0]) * 1e-9
            recovery_s = round(max(0.0, by_graph_s, (sound[1] - ended[1]) * speed), 3)
        report = next((line for line in self.lines if re.search(named, line)), '')
        return Verdict(
            kind=kind,
            bumps=self.bumps,
            wrong=self.wrong,
            worst_m=round(self.worst_m, 4),
            recovery_s=recovery_s,
            report=report,
            moment_s=began_ns * 1e-9,
            path_ended=self.paths_ended > 0,
        )
