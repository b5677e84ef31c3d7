"""Measures of driven paths against the truth, and statistics over many paths.

A run over the graph and an evaluation in one process both use them, so their numbers compare.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
import itertools
import math
from typing import Any, Final

import numpy as np

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.values import PathOutcome, Pose2

OUTCOMES: Final = ('goal', 'false-goal', 'bump', 'forbidden', 'timeout', 'declared')
"""Ends of a path; `declared`: in the goal by the estimate, without a truth to judge it by."""
_TRACE_TICKS = 5
"""From one position of the trace to the next. Chosen."""
_STANDING_M = 0.001
"""Nearer to its start than this the robot has not driven off. Chosen: a tenth of what it drives in
one control step."""


@dataclass(frozen=True, kw_only=True)
class PathResult:
    """One driven path, as `run --summary` and `evaluate --json` write it.

    Attributes:
        start: Pose the robot was placed at, in `map`.
        outcome: One of `OUTCOMES`, judged by the true position where that is known.
        duration_s: Simulated time from the start to the end.
        length_m: Length of the true path.
        turning_rad: Sum of the absolute changes of the true drive heading.
        max_heading_step_rad: Largest change of the commanded heading between two control steps,
            after the robot has left its start, by the truth. Until then it stands, searches for
            the landmarks and turns to its first heading; the command may change as the first
            estimate converges, without moving anything.
        pose_error_m: rms, p95 and max of the position error while the state's confidence was OK;
            empty without such a state or a truth.
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
    """Return rms, p95 and max of absolute errors; nothing if there are no errors."""
    if not errors:
        return {}
    values = np.abs(np.asarray(errors))
    return {
        'rms': float(np.sqrt(np.mean(values**2))),
        'p95': float(np.percentile(values, 95)),
        'max': float(values.max()),
    }


@dataclass(frozen=True, kw_only=True, slots=True)
class Tick:
    """One control step: true and estimated state at one stamp.

    Attributes:
        time_ns: Stamp of its image.
        truth: True pose.
        estimate: Estimated pose, or None while its confidence is not OK.
        commanded_heading_rad: Heading in `map` that the controller follows, or None.
    """

    time_ns: int
    truth: Pose2
    estimate: Pose2 | None
    commanded_heading_rad: float | None


def measure_path(
    start: Pose2, ticks: Sequence[Tick], outcome: PathOutcome, *, in_goal: bool | None
) -> PathResult:
    """Return the measures of a path from a pose in `map`.

    The outcome is the controller's. `in_goal` says whether the robot's true centre was inside the
    goal region at the end; None where the poses were estimates.
    """
    truths = [tick.truth for tick in ticks]
    moves = list(itertools.pairwise(truths))
    pairs = [(t.estimate, t.truth) for t in ticks if t.estimate and in_goal is not None]
    traced = (*truths[::_TRACE_TICKS], *truths[-1:])
    judged = outcome.value
    if outcome is PathOutcome.GOAL and not in_goal:
        judged = 'declared' if in_goal is None else 'false-goal'
    return PathResult(
        start=start,
        outcome=judged,
        duration_s=(ticks[-1].time_ns - ticks[0].time_ns) * 1e-9 if ticks else 0.0,
        length_m=math.fsum(_distance_m(*move) for move in moves),
        turning_rad=math.fsum(abs(_turn_rad(*move)) for move in moves),
        max_heading_step_rad=_largest_step_rad(start, ticks),
        pose_error_m=error_statistics([_distance_m(*pair) for pair in pairs]),
        heading_error_rad=error_statistics([_turn_rad(*pair) for pair in pairs]),
        trace=tuple((round(at.x_m, 4), round(at.y_m, 4)) for at in traced),
    )


def _largest_step_rad(start: Pose2, ticks: Sequence[Tick]) -> float:
    largest_rad, before_rad, under_way = 0.0, None, False
    for tick in ticks:
        under_way = under_way or _distance_m(start, tick.truth) > _STANDING_M
        heading_rad = tick.commanded_heading_rad
        if heading_rad is None:
            continue
        if under_way and before_rad is not None:
            largest_rad = max(largest_rad, abs(angle_difference(heading_rad, before_rad)))
        before_rad = heading_rad
    return largest_rad


def _distance_m(one: Pose2, other: Pose2) -> float:
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)


def _turn_rad(one: Pose2, other: Pose2) -> float:
    return angle_difference(one.heading_rad, other.heading_rad)


_MEASURES: Final = ('duration_s', 'length_m', 'turning_rad', 'pose_error_m', 'heading_error_rad')


@dataclass
class PathTally:
    """Statistics over paths, updated path by path in constant memory.

    Attributes:
        paths: Number of paths.
        goals: Number that reached the goal, judged by the true position.
        declared: Number that are in the goal by the estimate, without a truth to judge it by.
        judged: Number whose pose could be compared with the true one.
        total: Sum of 'duration_s', 'length_m', 'turning_rad', and of the 95th percentiles of a
            path's 'pose_error_m' and 'heading_error_rad'.
        worst: Maximum of each.
    """

    paths: int = 0
    goals: int = 0
    declared: int = 0
    judged: int = 0
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
        self.declared += result.outcome == 'declared'
        self.judged += bool(result.pose_error_m)
        for name in _MEASURES:
            measure = getattr(result, name)
            value = measure.get('p95', 0.0) if isinstance(measure, dict) else measure
            self.total[name] += value
            self.worst[name] = max(self.worst[name], value)

    def mean(self, name: str) -> float:
        """Return the mean of a measure over the paths that have it; 0 if there are none."""
        count = self.judged if name.endswith(('_error_m', '_error_rad')) else self.paths
        return self.total[name] / count if count else 0.0


_Z95 = 1.959964


def wilson_interval(successes: int, n: int) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a proportion of `n` trials, at least one."""
    share, z2 = successes / n, _Z95**2
    centre = (share + z2 / (2 * n)) / (1 + z2 / n)
    half = _Z95 * math.sqrt(share * (1 - share) / n + z2 / (4 * n * n)) / (1 + z2 / n)
    return max(0.0, centre - half), min(1.0, centre + half)
