"""Driving with images in the loop: crisp against the fuzzy blends, on the same starts."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import math
from typing import TYPE_CHECKING

from goalreach_evaluation.path_metrics import wilson_interval
from goalreach_lab.row import BenchRow, Goal

if TYPE_CHECKING:
    from goalreach_evaluation.path_metrics import PathResult
    from goalreach_msgs_py.regions import RegionMap
    from goalreach_msgs_py.values import Pose2


SUMMARY = 'Crisp and fuzzy driving with rendered images, over random and border starts'

_MODES = ('crisp', 'fuzzy', 'fuzzy-eq3', 'fuzzy-as-printed')
_LARGEST_STEP_DEG = 10.0


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    parser.add_argument(
        '--starts',
        type=int,
        default=100,
        help='random starts over the free floor, and as many at the borders, for each mode',
    )
    parser.add_argument('--noise', default='nominal', help='none, nominal, harsh or a file')
    parser.add_argument('--jobs', type=int, default=1, help='processes')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Drive every mode from the same starts.

    Raises:
        GoalreachError: An option or a file is refused.
    """
    import numpy as np

    from goalreach_evaluation.choices import choose_noise
    from goalreach_evaluation.sessions import EvaluationPlan, drive_sessions
    from goalreach_evaluation.starts import border_starts, random_starts
    from goalreach_learning.controller_config import ControllerConfig
    from goalreach_learning.training import train
    from goalreach_msgs_py.arena import Arena
    from goalreach_msgs_py.errors import ConfigurationError

    for name in ('starts', 'jobs'):
        if getattr(options, name) < 1:
            raise ConfigurationError(f'--{name}', getattr(options, name), 'a whole number >= 1')
    arena = Arena()
    learner, places = np.random.SeedSequence(options.seed).spawn(2)
    policy = train(arena, rng=np.random.default_rng(learner)).policy
    rng = np.random.default_rng(places)
    starts = [
        *random_starts(arena, options.starts, rng),
        *border_starts(arena, options.starts, rng),
    ]
    driven: dict[str, list[PathResult]] = {}
    for mode in _MODES:
        plan = EvaluationPlan(
            arena=arena,
            noise=choose_noise(options.noise),
            policy=policy,
            controller=ControllerConfig(mode=mode),
            starts=starts,
            seed=options.seed,
        )
        sessions = drive_sessions(plan, jobs=options.jobs)
        driven[mode] = [path for session in sessions for path in session.paths]
    return [row for mode in _MODES for row in _rows(mode, driven, arena.regions, options.noise)]


def distance_to_goal(start: Pose2, regions: RegionMap) -> float:
    """Return the length of the shortest path into the goal region, metres.

    Args:
        start: Where it begins.
        regions: The region map; the floor is convex, so the path is straight.
    """
    x_low, y_low, x_high, y_high = regions.bounds(regions.goal)
    return math.hypot(
        max(x_low - start.x_m, 0.0, start.x_m - x_high),
        max(y_low - start.y_m, 0.0, start.y_m - y_high),
    )


def _rows(
    mode: str, driven: dict[str, list[PathResult]], regions: RegionMap, noise: str
) -> list[BenchRow]:
    paths, crisp = driven[mode], driven['crisp']
    goals = sum(path.outcome == 'goal' for path in paths)
    low, high = wilson_interval(goals, len(paths))
    lost = {kind: sum(p.outcome == kind for p in paths) for kind in _lost_kinds(paths)}
    must = 100.0 if noise in ('none', 'nominal') else 99.5
    rows = [
        BenchRow(
            name=f'{mode}: goal reached',
            unit='% of paths',
            ours=100.0 * goals / len(paths),
            goal=Goal(of='ours', relation='>=', bound=must) if mode == 'fuzzy' else None,
            n=len(paths),
            note=f'95 % interval {100 * low:.2f} to {100 * high:.2f} %'
            + ''.join(f'; {kind} {count}' for kind, count in lost.items()),
        )
    ]
    figures = (
        ('time to the goal, mean', 's', _mean_time),
        ('total turning, mean', 'deg', _mean_turning),
        ('length over the shortest path, mean', 'm', lambda p: _mean_detour(p, regions)),
    )
    for name, unit, figure in figures:
        rows.append(
            BenchRow(
                name=f'{mode}: {name}',
                unit=unit,
                ours=figure(paths),
                reference=None if mode == 'crisp' else figure(crisp),
                reference_name='crisp',
                n=goals,
            )
        )
    step_deg = max(math.degrees(path.max_heading_step_rad) for path in paths)
    step_goal = Goal(of='ours', relation='<=', bound=_LARGEST_STEP_DEG)
    rows.append(
        BenchRow(
            name=f'{mode}: largest change of the commanded heading in a step',
            unit='deg',
            ours=step_deg,
            goal=step_goal if mode == 'fuzzy' else None,
            n=len(paths),
        )
    )
    return rows


def _lost_kinds(paths: Sequence[PathResult]) -> list[str]:
    return sorted({path.outcome for path in paths} - {'goal'})


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values) if values else math.nan


def _mean_time(paths: Sequence[PathResult]) -> float:
    return _mean([path.duration_s for path in paths if path.outcome == 'goal'])


def _mean_turning(paths: Sequence[PathResult]) -> float:
    return math.degrees(_mean([path.turning_rad for path in paths if path.outcome == 'goal']))


def _mean_detour(paths: Sequence[PathResult], regions: RegionMap) -> float:
    """Return the mean length driven beyond the shortest path into the goal, metres."""
    return _mean(
        [
            path.length_m - distance_to_goal(path.start, regions)
            for path in paths
            if path.outcome == 'goal'
        ]
    )
