"""Observes a running stack: bumps, overconfident poses, and whether it drives normally."""

from collections import deque
import math
from typing import Final, TypeAlias

from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.values import Confidence, Odometry, RegionState, Twist2

Moment: TypeAlias = tuple[int, float]
"""A moment by the graph's clock, nanoseconds, and by the wall clock, seconds."""

GOOD_POSE_M: Final = 6.0 * INCH_M
"""A pose with confidence OK that is farther off than this is overconfident."""

_FRESH_S: Final = 0.2
_NORMAL_TICKS: Final = 10
"""More ticks than a command stays fresh: a chain that has just broken does not count. Chosen."""

_TOUCH_M: Final = 1e-4
_KEPT: Final = 4000
_MOVES: Final = 0.01


class StackObserver:
    """The state of a running stack, from its messages and logs.

    It drives normally where it moves, and state and command are fresh, for some ticks in a row.

    Attributes:
        arena: Arena in which the robot drives.
        clock_ns: The last tick of the graph's clock.
        sent_ns: Ticks and when they were sent by the system's clock, where that is known.
        bumps: Walls and obstacles run into since the last `reset_counts`.
        overconfident: States with confidence OK that were off by more than 6 in since then.
        worst_m: Largest error of a state with confidence OK since then.
        paths_ended: Paths that ended since then.
        lines: Messages of nodes and launcher since then.
        normal_since: First moment of normal driving, or None where it does not drive normally.
    """

    def __init__(self, arena: Arena) -> None:
        self.arena = arena
        self._truth: dict[int, Odometry] = {}
        self._order: deque[int] = deque()
        self._touching = False
        self._normal_ticks = 0
        self._good_ns = self._command_ns = 0
        self._first: Moment = (0, 0.0)
        self._moving = False
        self.clock_ns = 0
        self.sent_ns: dict[int, int] = {}
        self.lines: deque[str] = deque(maxlen=_KEPT)
        self.reset_counts()

    def reset_counts(self) -> None:
        """Count from now on: a fault begins."""
        self.bumps = self.overconfident = self.paths_ended = 0
        self.worst_m = 0.0
        self.normal_since: Moment | None = None
        self.lines.clear()

    def await_normal(self) -> None:
        """Look for normal driving from now on: a fault has ended."""
        self._normal_ticks = 0
        self.normal_since = None

    def clock_at(self, wall_ns: int) -> int:
        """Return the graph's clock at a past moment: the last tick sent by then.

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
        """The robot's true distance from the goal wall."""
        truth = self._truth.get(self.clock_ns)
        return 0.0 if truth is None else truth.pose.y_m

    def on_truth(self, stamp_ns: int, truth: Odometry, *, wall_s: float) -> None:
        """Process the true pose and velocity, one per tick of the graph's clock.

        Args:
            stamp_ns: The tick.
            truth: True pose and velocity.
            wall_s: The time now by a steady wall clock.
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
        normal = self._moving and fresh_ns <= self._good_ns <= stamp_ns
        normal = normal and fresh_ns <= self._command_ns <= stamp_ns
        self._normal_ticks = self._normal_ticks + 1 if normal else 0
        if self._normal_ticks == 1:
            self._first = (stamp_ns, wall_s)
        self.normal_since = self._first if self._normal_ticks >= _NORMAL_TICKS else None

    def _touches(self, truth: Odometry) -> bool:
        x_m, y_m = truth.pose.x_m, truth.pose.y_m
        return not self.arena.is_free(x_m, y_m, body_radius_m=BODY_RADIUS_M + _TOUCH_M)

    def on_state(self, stamp_ns: int, state: RegionState) -> None:
        """Process an estimated state."""
        # One from the future is compared with the newest truth.
        truth = self._truth.get(min(stamp_ns, self.clock_ns))
        if state.confidence is not Confidence.OK or truth is None:
            return
        error_m = math.hypot(state.pose.x_m - truth.pose.x_m, state.pose.y_m - truth.pose.y_m)
        self.worst_m = max(self.worst_m, error_m)
        if error_m > GOOD_POSE_M:
            self.overconfident += 1
        elif stamp_ns <= self.clock_ns:
            self._good_ns = stamp_ns

    def on_command(self, stamp_ns: int, command: Twist2) -> None:
        """Process a command that reached the robot."""
        self._command_ns = stamp_ns
        speed, rate = command.linear_m_per_s, command.steering_rad_per_s
        self._moving = abs(speed) > _MOVES or abs(rate) > _MOVES
