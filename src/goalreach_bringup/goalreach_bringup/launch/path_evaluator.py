"""Evaluation of driven paths against the ground truth, from the topics of a running graph."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
import itertools
import math
from typing import Final

from goalreach_evaluation.path_metrics import PathResult, Tick, measure_path
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import PathOutcome, Pose2, Region

_PLACED_M: Final = 0.01
"""A robot this near to a start has been placed there. Chosen."""
_CARRIED_M: Final = 0.2
"""A robot that moved further between two ticks was carried: it drives a tenth of that. Chosen."""


@dataclass(frozen=True, kw_only=True)
class Progress:
    """Progress of a run, from which a restarted node continues.

    Attributes:
        path: Number of the current path.
        placed: Whether the robot has been placed for it.
        last_ns: Last stamp received, evaluated or not; 0 before the first.
        truth: True pose at that stamp, or None before the first.
    """

    path: int
    placed: bool
    last_ns: int
    truth: Pose2 | None


@dataclass
class PathEvaluator:
    """Splits the stream of ticks into paths and evaluates each.

    Outcomes arrive in the order of their paths. A path whose outcome or ticks were not received is
    not judged: its result is None, and evaluation continues with the next one.

    Attributes:
        starts: Start poses in the order driven, or empty where the robot is not placed.
        regions: The region map, for the true goal.
        path: Number of the current path; at the start, of the first one.
        judged: Whether ticks hold the truth; otherwise its place is taken by the estimate.
        last: Stamp and true pose of the last tick; 0 and None before the first.
    """

    starts: Sequence[Pose2]
    regions: RegionMap
    _: KW_ONLY
    path: int = 0
    judged: bool = True
    last: tuple[int, Pose2 | None] = (0, None)
    _ticks: list[Tick] = field(default_factory=list)
    _outcomes: dict[int, tuple[int, PathOutcome]] = field(default_factory=dict)

    @property
    def has_begun(self) -> bool:
        """Whether the current path has a tick: the robot has been placed for it."""
        return bool(self._ticks)

    def move_goal(self, goal: Region) -> None:
        """Judge by the new goal region of the controller from now on."""
        self.regions = replace(self.regions, goal=goal)

    def begin_path(self) -> None:
        """Begin the current path with the next tick: until now the robot was being placed."""
        self._ticks.clear()

    def restart_clock(self) -> None:
        """Discard the ticks of the current path: a restarted robot has a new clock."""
        self._ticks.clear()
        self._outcomes.clear()
        self.last = (0, self.last[1])

    def add_tick(self, tick: Tick) -> list[PathResult | None]:
        """Add a tick; return the paths that it completes. A repeated tick is ignored."""
        if tick.time_ns <= self.last[0]:
            return []
        self._ticks.append(tick)
        self.last = tick.time_ns, tick.truth
        return self._evaluate()

    def add_outcome(
        self, time_ns: int, path: int, outcome: PathOutcome
    ) -> list[PathResult | None]:
        """Add an outcome from the controller; return the paths that it completes."""
        if path >= self.path:
            self._outcomes[path] = (time_ns, outcome)
        return self._evaluate()

    def evaluate_pending(self) -> list[PathResult | None]:
        """Return the paths with a known outcome, without waiting for their last ticks."""
        return self._evaluate(final=True)

    def _evaluate(self, *, final: bool = False) -> list[PathResult | None]:
        """Close the current path once its outcome and a tick of that stamp or later are known.

        On an overloaded machine ticks are lost in transport; then the nearest one counts.
        """
        results: list[PathResult | None] = []
        while self._outcomes:
            path = min(self._outcomes)
            end_ns, outcome = self._outcomes[path]
            if self.last[0] < end_ns and not final:
                break
            del self._outcomes[path]
            count = bisect_right(self._ticks, end_ns, key=lambda tick: tick.time_ns)
            ticks, self._ticks = self._ticks[:count], self._ticks[count:]
            truth = ticks[-1].truth if ticks else self.last[1]
            skipped, self.path = path - self.path, path
            results += [None] * skipped
            if truth is None:
                results.append(None)
            else:
                placed = bool(self.starts) and not skipped
                driven = ticks if placed else self._since_last_placing(ticks)
                results.append(self._close(driven, truth, outcome))
            self.path += 1
        return results

    def _close(self, ticks: list[Tick], truth: Pose2, outcome: PathOutcome) -> PathResult:
        """Measure the current path by its ticks since the robot was placed, or seen nearby."""
        away_m = [self._from_start_m(tick) for tick in ticks]
        near_m = max(_PLACED_M, min(away_m, default=0.0))
        begin = (number for number, each_m in enumerate(away_m) if each_m <= near_m <= _CARRIED_M)
        ticks = ticks[next(begin, len(ticks)) :]
        start = self._start(ticks[0].truth if ticks else truth)
        in_goal = self.regions.region_at(truth.x_m, truth.y_m) == self.regions.goal
        return measure_path(start, ticks, outcome, in_goal=in_goal if self.judged else None)

    def _since_last_placing(self, ticks: list[Tick]) -> list[Tick]:
        """Return the ticks since the robot last arrived at the start, or was carried."""
        began = 0
        for number, (earlier, later) in enumerate(itertools.pairwise(ticks), 1):
            one, other = earlier.truth, later.truth
            carried = math.hypot(other.x_m - one.x_m, other.y_m - one.y_m) > _CARRIED_M
            arrived = self._from_start_m(later) <= _PLACED_M < self._from_start_m(earlier)
            if arrived or (carried and not self.starts):
                began = number
        return ticks[began:]

    def _start(self, truth: Pose2) -> Pose2:
        return self.starts[self.path % len(self.starts)] if self.starts else truth

    def _from_start_m(self, tick: Tick) -> float:
        start = self._start(tick.truth)
        return math.hypot(tick.truth.x_m - start.x_m, tick.truth.y_m - start.y_m)
