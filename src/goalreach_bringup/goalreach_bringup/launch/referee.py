"""Judging paths by the truth, from the topics of a running graph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import itertools
import math

from goalreach_bringup.launch.tick_log import Tick, TickLog
from goalreach_evaluation.path_metrics import PathMeter, PathResult
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import PathOutcome, Pose2

_PLACED_M = 0.01


@dataclass(frozen=True, kw_only=True)
class Progress:
    """How far a run is: what a restarted node needs to go on.

    Attributes:
        path: Number of the running path.
        on_the_way: Whether the robot has been placed for it.
        last_ns: Last stamp judged.
        truth: True pose at that stamp, or None before the first.
    """

    path: int
    on_the_way: bool
    last_ns: int
    truth: Pose2 | None


class Referee:
    """Cuts the stream of ticks into paths and judges each.

    Outcomes come in the order of their paths. A path whose outcome or ticks were not heard is not
    judged, but counted, and the next one is waited for.

    Args:
        starts: Starting poses in the order driven, or empty where the robot is not placed.
        regions: The region map, for the true goal.
        first_path: Number of the first path.

    Attributes:
        last_ns: Stamp of the last tick.
        unjudged: Numbers of the paths that ended and could not be judged.
    """

    def __init__(
        self, starts: Sequence[Pose2], regions: RegionMap, *, first_path: int = 0
    ) -> None:
        """Wait for the first path."""
        self._starts = tuple(starts)
        self._regions = regions
        self._path = first_path
        self._ticks = TickLog()
        self._outcomes: dict[int, tuple[int, PathOutcome]] = {}
        self.last_ns = 0
        self.unjudged: list[int] = []
        self._truth: Pose2 | None = None

    @property
    def waits(self) -> bool:
        """Whether an outcome waits for the tick of its stamp."""
        return bool(self._outcomes)

    @property
    def progress(self) -> Progress:
        """How far the run is."""
        return Progress(
            path=self._path,
            on_the_way=bool(self._ticks),
            last_ns=self.last_ns,
            truth=self._truth,
        )

    def add_tick(self, tick: Tick) -> list[PathResult]:
        """Add a tick; return the paths that it completes. One that was there is left out."""
        if tick.time_ns <= self.last_ns:
            return []
        self._ticks.append(tick)
        self.last_ns, self._truth = tick.time_ns, tick.truth
        return self._judge()

    def add_outcome(self, time_ns: int, path: int, outcome: PathOutcome) -> list[PathResult]:
        """Add the controller's word that a path ended; return the paths that it completes."""
        if path >= self._path:
            self._outcomes[path] = (time_ns, outcome)
        return self._judge()

    def settle(self) -> list[PathResult]:
        """Return the paths whose outcome is known and whose last ticks will not come any more."""
        return self._judge(settled=True)

    def _judge(self, *, settled: bool = False) -> list[PathResult]:
        """Close the running path when its outcome is there, and the tick of that stamp or a later.

        On an overloaded machine ticks are lost on their way here; then the nearest one counts.
        """
        results: list[PathResult] = []
        while self._outcomes:
            path = min(self._outcomes)
            end_ns, outcome = self._outcomes[path]
            if self.last_ns < end_ns and not settled:
                break
            del self._outcomes[path]
            ticks = self._ticks.take_until(end_ns)
            truth = ticks[-1].truth if ticks else self._truth
            skipped = range(self._path, path)
            self._path = path
            self.unjudged.extend(skipped)
            if truth is None:
                self.unjudged.append(path)
            else:
                results.append(
                    self._close(self._of_last_placing(ticks) if skipped else ticks, truth, outcome)
                )
            self._path += 1
        return results

    def _close(self, ticks: TickLog, truth: Pose2, outcome: PathOutcome) -> PathResult:
        """Measure the running path by its ticks; what comes before the placing is left out."""
        begin = (number for number, tick in enumerate(ticks) if self._is_at_start(tick))
        ticks = ticks[next(begin, len(ticks)) :]
        meter = PathMeter(self._start(ticks[0].truth if ticks else truth))
        for tick in ticks:
            meter.add(
                time_ns=tick.time_ns,
                truth=tick.truth,
                estimate=tick.estimate,
                commanded_heading_rad=tick.commanded_heading_rad,
            )
        in_goal = self._regions.region_at(truth.x_m, truth.y_m) == self._regions.goal
        return meter.finish(outcome, in_goal=in_goal)

    def _of_last_placing(self, ticks: TickLog) -> TickLog:
        """Return the ticks from when the robot came to the start for the last time."""
        began = 0
        for number, (earlier, later) in enumerate(itertools.pairwise(ticks), 1):
            if self._is_at_start(later) and not self._is_at_start(earlier):
                began = number
        return ticks[began:]

    def _start(self, truth: Pose2) -> Pose2:
        return self._starts[self._path % len(self._starts)] if self._starts else truth

    def _is_at_start(self, tick: Tick) -> bool:
        start = self._start(tick.truth)
        return math.hypot(tick.truth.x_m - start.x_m, tick.truth.y_m - start.y_m) <= _PLACED_M
