"""Measures of driven paths against the truth, and statistics over many paths.

A run over the graph and an evaluation in one process both use them, so their numbers compare.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
import math
from typing import Any, Final

import numpy as np

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.values import PathOutcome, Pose2

OUTCOMES: Final = ('goal', 'false-goal', 'bump', 'timeout')
_STANDING_M = 0.001
"""Nearer to its start than this the robot has not driven off. Chosen: a tenth of what it drives in
one control step."""


@dataclass(frozen=True, kw_only=True)
class PathResult:
    """One driven path, as `run --summary` and `evaluate --json` write it.

    Attributes:
        start: Pose the robot was placed at, in `map`.
        outcome: One of `OUTCOMES`, judged by the true position.
        duration_s: Simulated time from the start to the end.
        length_m: Length of the true path.
        turning_rad: Sum of the absolute changes of the true drive heading.
        max_heading_step_rad: Largest change of the commanded heading between two control steps,
            after the robot has left its start: see `PathMeter`.
        pose_error_m: rms, p95 and max of the position error while the state's confidence was OK.
        heading_error_rad: The same of the heading error.
        trace: True positions (x, y) along the path, metres.
    """

    start: Pose2
    outcome: str
    duration_s: float
    length_m: float
    turning_rad: float
    max_heading_step_rad: float
    pose_error_m: dict[str, float]
    heading_error_rad: dict[str, float]
    trace: tuple[tuple[float, float], ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the result as JSON-ready values; the start as [x_m, y_m, heading_rad]."""
        start = [self.start.x_m, self.start.y_m, self.start.heading_rad]
        return vars(self) | {'start': start, 'trace': [list(point) for point in self.trace]}


def error_statistics(errors: Sequence[float]) -> dict[str, float]:
    """Return rms, p95 and max of absolute errors; zeros if there are no errors."""
    if not errors:
        return {'rms': 0.0, 'p95': 0.0, 'max': 0.0}
    values = np.abs(np.asarray(errors))
    return {
        'rms': float(np.sqrt(np.mean(values**2))),
        'p95': float(np.percentile(values, 95)),
        'max': float(values.max()),
    }


@dataclass
class PathMeter:
    """Measures one path tick by tick.

    Changes of the commanded heading count once the robot has left its start, by the truth. Until
    then it stands, searches for the landmarks and turns to its first heading; the command may
    change as the first estimate converges, without moving anything.

    Attributes:
        start: Pose the robot was placed at.
        trace_step: Ticks from one position of the trace to the next.
    """

    start: Pose2
    trace_step: int = 5
    _ticks: int = 0
    _first_ns: int = 0
    _last_ns: int = 0
    _last_truth: Pose2 | None = None
    _last_heading_rad: float | None = None
    _length_m: float = 0.0
    _turning_rad: float = 0.0
    _max_step_rad: float = 0.0
    _under_way: bool = False
    # Arrays: a path that ends by time-out has thousands of numbers.
    _position_errors_m: array[float] = field(default_factory=lambda: array('d'))
    _heading_errors_rad: array[float] = field(default_factory=lambda: array('d'))
    _trace_m: array[float] = field(default_factory=lambda: array('d'))

    def add(
        self,
        *,
        time_ns: int,
        truth: Pose2,
        estimate: Pose2 | None,
        commanded_heading_rad: float | None,
    ) -> None:
        """Add one control step.

        Args:
            time_ns: Stamp of its image.
            truth: True pose.
            estimate: Estimated pose, or None while its confidence is not OK.
            commanded_heading_rad: Heading in `map` that the controller follows, or None.
        """
        if self._last_truth is None:
            self._first_ns = time_ns
        else:
            last = self._last_truth
            self._length_m += math.hypot(truth.x_m - last.x_m, truth.y_m - last.y_m)
            self._turning_rad += abs(angle_difference(truth.heading_rad, last.heading_rad))
        if estimate is not None:
            error_m = math.hypot(estimate.x_m - truth.x_m, estimate.y_m - truth.y_m)
            self._position_errors_m.append(error_m)
            turn_rad = angle_difference(estimate.heading_rad, truth.heading_rad)
            self._heading_errors_rad.append(turn_rad)
        if commanded_heading_rad is not None:
            if self._last_heading_rad is not None and self._left_start(truth):
                step_rad = abs(angle_difference(commanded_heading_rad, self._last_heading_rad))
                self._max_step_rad = max(self._max_step_rad, step_rad)
            self._last_heading_rad = commanded_heading_rad
        if self._ticks % self.trace_step == 0:
            self._trace_m.extend((truth.x_m, truth.y_m))
        self._ticks += 1
        self._last_ns, self._last_truth = time_ns, truth

    def _left_start(self, truth: Pose2) -> bool:
        """Return whether the robot has driven off, now or before."""
        gone_m = math.hypot(truth.x_m - self.start.x_m, truth.y_m - self.start.y_m)
        self._under_way = self._under_way or gone_m > _STANDING_M
        return self._under_way

    def finish(self, outcome: PathOutcome, *, in_goal: bool) -> PathResult:
        """Return the result.

        Args:
            outcome: How the path ended according to the controller.
            in_goal: Whether the robot's true centre was inside the goal region at that moment.
        """
        judged = outcome.value
        trace_m = [*self._trace_m]
        if self._last_truth is not None:
            trace_m += [self._last_truth.x_m, self._last_truth.y_m]
        trace_m = [round(value, 4) for value in trace_m]
        if outcome is PathOutcome.GOAL and not in_goal:
            judged = 'false-goal'
        return PathResult(
            start=self.start,
            outcome=judged,
            duration_s=(self._last_ns - self._first_ns) * 1e-9,
            length_m=self._length_m,
            turning_rad=self._turning_rad,
            max_heading_step_rad=self._max_step_rad,
            pose_error_m=error_statistics(self._position_errors_m),
            heading_error_rad=error_statistics(self._heading_errors_rad),
            trace=tuple(zip(trace_m[::2], trace_m[1::2], strict=True)),
        )


_MEASURES: Final = ('duration_s', 'length_m', 'turning_rad', 'pose_error_m', 'heading_error_rad')


@dataclass
class PathTally:
    """Statistics over paths, updated path by path in constant memory.

    Attributes:
        paths: Number of paths.
        goals: Number that reached the goal, judged by the true position.
        total: Sum of 'duration_s', 'length_m', 'turning_rad', and of the 95th percentiles of a
            path's 'pose_error_m' and 'heading_error_rad'.
        worst: Maximum of each.
    """

    paths: int = 0
    goals: int = 0
    total: dict[str, float] = field(default_factory=lambda: dict.fromkeys(_MEASURES, 0.0))
    worst: dict[str, float] = field(default_factory=lambda: dict.fromkeys(_MEASURES, 0.0))

    @classmethod
    def of(cls, results: Iterable[PathResult]) -> PathTally:
        """Return the statistics of paths."""
        tally = cls()
        for result in results:
            tally.add(result)
        return tally

    def add(self, result: PathResult) -> None:
        """Add a path."""
        self.paths += 1
        self.goals += result.outcome == 'goal'
        for name in _MEASURES:
            measure = getattr(result, name)
            value = measure['p95'] if isinstance(measure, dict) else measure
            self.total[name] += value
            self.worst[name] = max(self.worst[name], value)

    def mean(self, name: str) -> float:
        """Return the mean of one of the measures over the paths; 0 if there are none."""
        return self.total[name] / self.paths if self.paths else 0.0


_Z95 = 1.959964


def wilson_interval(successes: int, n: int) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a proportion.

    Args:
        successes: Number of successes.
        n: Number of trials, at least 1.
    """
    share, z2 = successes / n, _Z95**2
    centre = (share + z2 / (2 * n)) / (1 + z2 / n)
    half = _Z95 * math.sqrt(share * (1 - share) / n + z2 / (4 * n * n)) / (1 + z2 / n)
    return max(0.0, centre - half), min(1.0, centre + half)
