"""The driving suite: crisp and fuzzy driving from the same starts, with images in the loop."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
import statistics

from goalreach_evaluation.choices import choose_noise, choose_policy
from goalreach_evaluation.path_metrics import wilson_interval
from goalreach_evaluation.starts import RunSeeds
from goalreach_lab.options import StudyOptions
from goalreach_lab.reproduction.driving_study import (
    KINDS,
    MODES,
    Condition,
    DrivenPath,
    driving_study,
    to_goal,
)
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study import find
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.options import option

SUMMARY = 'Crisp and fuzzy driving with rendered images, from random and border starts'

_LARGEST_STEP_DEG = 10.0


@dataclass(frozen=True, kw_only=True)
class Options(StudyOptions):
    """Options of the suite."""

    starts: int = option(100, 'random starts, and border starts, of each mode', minimum=1)
    noise: str = option('nominal', 'sensor errors: none, nominal, harsh or a YAML file')


def execute(options: Options) -> list[BenchRow]:
    """Drive every mode from the same starts and return the rows.

    Raises:
        GoalreachError: A file is refused or cannot be written.
    """
    arena = Arena()
    policy = choose_policy(None, arena, RunSeeds.spawn(options.seed).training)
    conditions = {
        (mode, kind): Condition(
            name=f'{options.noise} {mode} {kind}',
            arena=arena,
            policy=policy,
            mode=mode,
            noise=choose_noise(options.noise),
            kind=kind,
            paths=options.starts,
            seed=options.seed,
        )
        for mode in MODES
        for kind in KINDS
    }
    study = driving_study(
        list(conditions.values()), name='driving', seed=options.seed, jobs=options.jobs
    )
    driven = find(study, options.results, measure=not options.as_it_is) or {}
    paths = {
        mode: [path for kind in KINDS for path in driven.get(conditions[mode, kind].name, ())]
        for mode in MODES
    }
    least = 100.0 if options.noise in ('none', 'nominal') else 99.5
    return [row for mode in MODES if paths[mode] for row in _rows(mode, paths, least)]


def goal_row(name: str, paths: Sequence[DrivenPath], least: float | None) -> BenchRow:
    """Return the row of the share of paths that reached the goal.

    Args:
        name: What was driven.
        paths: Its paths, at least one.
        least: Goal of the row in percent, or None.
    """
    reached = len(to_goal(paths))
    low, high = wilson_interval(reached, len(paths))
    lost = Counter(path.outcome for path in paths if path.outcome != 'goal')
    return BenchRow(
        name=f'{name}: goal reached',
        unit='% of paths',
        ours=100.0 * reached / len(paths),
        goal=None if least is None else Goal(of='ours', relation='>=', bound=least),
        n=len(paths),
        note=f'95 % interval {100 * low:.2f} to {100 * high:.2f} %'
        + ''.join(f'; {outcome} {count}' for outcome, count in sorted(lost.items())),
    )


def _rows(mode: str, paths: dict[str, list[DrivenPath]], least: float) -> list[BenchRow]:
    fuzzy = mode == 'fuzzy'
    step = Goal(of='ours', relation='<=', bound=_LARGEST_STEP_DEG)
    figures: tuple[tuple[str, str, Callable[[DrivenPath], float]], ...] = (
        ('time to the goal, mean', 's', lambda path: path.duration_s),
        ('total turning, mean', 'deg', lambda path: path.turning_deg),
        ('excess over the shortest path, mean', 'm', lambda path: path.length_m - path.shortest_m),
    )

    def mean(figure: Callable[[DrivenPath], float], of: str) -> float:
        good = to_goal(paths[of])
        return statistics.fmean(map(figure, good)) if good else math.nan

    return [
        goal_row(mode, paths[mode], least if fuzzy else None),
        *(
            BenchRow(
                name=f'{mode}: {name}',
                unit=unit,
                ours=mean(figure, mode),
                reference=None if mode == 'crisp' else mean(figure, 'crisp'),
                reference_name='crisp',
                n=len(to_goal(paths[mode])),
            )
            for name, unit, figure in figures
        ),
        BenchRow(
            name=f'{mode}: largest change of the commanded heading in a step',
            unit='deg',
            ours=max(path.step_deg for path in paths[mode]),
            goal=step if fuzzy else None,
            n=len(paths[mode]),
        ),
    ]
