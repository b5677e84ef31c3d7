"""The `sweep` command: seeds x noise x arenas, on processes or on a Dask cluster."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass
import functools
from pathlib import Path
from typing import Any

import numpy as np

from goalreach_evaluation.choices import choose_arena, choose_noise
from goalreach_learning.blending import MODES
from goalreach_msgs_py.files import require_writable
from goalreach_msgs_py.options import REQUIRED, SeededOptions, option
from goalreach_msgs_py.values import FloatArray

SUMMARY = 'Learn and drive over seeds x noise x arenas, on processes or on a Dask cluster'
_NEEDED = (('paths', 'paths'), ('bumps', 'bumps'), ('length_m', 'm'), ('time_s', 's'))
_PROFILE = (5, 10, 15, 20, 40, 80, 160, 440)
"""Numbers of paths at which a performance profile is printed. Chosen."""


@dataclass(frozen=True, kw_only=True)
class Options(SeededOptions):
    """Options of the command."""

    results: Path = option(REQUIRED, 'append a JSON line for each case')
    arenas: tuple[str, ...] = option(('paper',), 'where to drive', metavar='NAME|FILE')
    noise: tuple[str, ...] = option(('nominal',), 'sensor errors', metavar='NAME|FILE')
    seeds: int = option(10, 'number of seeds, counted up from --seed', minimum=1)
    drives: int = option(22, 'random starts of each case', minimum=1)
    mode: str = option('fuzzy', 'how the heading is chosen', choices=MODES)
    learners: tuple[str, ...] = option(
        (), 'in place of drives: let these learn, and count paths and bumps until the policy '
        'leads to the goal from every start', metavar='NAME|MODULE:CLASS',
    )  # fmt: skip
    no_images: bool = option(False, 'let the learners drive without images and noise')
    limit: int = option(440, 'paths after which a learner has failed', minimum=1)
    after: int = option(22, 'further paths, in which a learner should not forget', minimum=0)
    jobs: int = option(1, 'processes, or workers on this machine', minimum=1)
    engine: str = option('processes', 'what runs the cases', choices=('processes', 'dask'))
    scheduler: str | None = option(None, 'address of a running Dask scheduler', metavar='ADDRESS')


def execute(options: Options) -> int:
    """Run what the file of results does not hold yet; print the shares."""
    from goalreach_evaluation.results_file import ResultsFile
    from goalreach_evaluation.sweep import drive_case, learn_case, run_cases

    require_writable(options.results)
    cases = _cases(options)
    measure: Callable[[Any], dict[str, Any]]
    measure = learn_case if options.learners else drive_case
    results = ResultsFile(options.results, key=tuple(cases[0].key))
    left = [case for case in cases if results.missing([case.key])]
    print(f'{len(cases) - len(left)} of {len(cases)} cases are done', flush=True)
    for case, result in run_cases(left, measure, _executor(options)):
        results.add(case.key, result)
    done = results.select([case.key for case in cases])
    _show_learners(done, options.learners) if options.learners else _show(done)
    return 0


def _cases(options: Options) -> list[Any]:
    from goalreach_evaluation.sweep import CurveCase, SweepCase

    blind = bool(options.learners) and options.no_images
    rooms: list[dict[str, Any]] = [
        {
            'arena_name': arena,
            'arena': choose_arena(arena),
            'noise_name': 'without images' if blind else noise,
            'noise': None if blind else choose_noise(noise),
            'seed': options.seed + number,
        }
        for arena in options.arenas
        for noise in options.noise[: 1 if blind else None]
        for number in range(options.seeds)
    ]
    if not options.learners:
        return [SweepCase(mode=options.mode, drives=options.drives, **room) for room in rooms]
    return [
        CurveCase(learner=learner, limit=options.limit, after=options.after, **room)
        for learner in options.learners
        for room in rooms
    ]


def _executor(options: Options) -> Callable[[], AbstractContextManager[Executor]]:
    from goalreach_evaluation.evaluation import processes
    from goalreach_evaluation.sweep import dask_workers

    if options.engine == 'dask' or options.scheduler:
        return functools.partial(dask_workers, options.jobs, options.scheduler)
    return functools.partial(processes, options.jobs)


def _show(results: Sequence[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table

    from goalreach_evaluation.path_metrics import wilson_interval

    table = Table('arena', 'noise', 'mode', 'seeds', 'paths', 'to the goal', '95 % interval')
    groups: dict[tuple[str, str, str], list[dict[str, int]]] = {}
    for result in results:
        key = (result['arena'], result['noise'], result['mode'])
        groups.setdefault(key, []).append(result['outcomes'])
    for key, outcomes in groups.items():
        paths = sum(sum(one.values()) for one in outcomes)
        goals = sum(one.get('goal', 0) for one in outcomes)
        low, high = wilson_interval(goals, paths)
        share = f'{100 * goals / paths:.2f} %'
        interval = f'{100 * low:.2f} to {100 * high:.2f} %'
        table.add_row(*key, str(len(outcomes)), str(paths), share, interval)
    Console(highlight=False).print(table)


def _show_learners(results: Sequence[dict[str, Any]], learners: Sequence[str]) -> None:
    """Print what each learner needed over all cases, and compare it with the first."""
    from goalreach_evaluation import statistics

    rng, scores = np.random.default_rng(0), [_scores(results, name) for name in learners]
    for name, score in zip(learners, scores, strict=True):
        rows = [row for row in results if row['learner'] == name]
        learned, lost = (sum(row[field] > 0 for row in rows) for field in ('learned', 'lost'))
        print(f'{name}: {learned} of {len(rows)} runs learned; {lost} lost it later')
        spreads = []
        timed = any(row['time_s'] for row in rows)  # with images only
        for field, unit in _NEEDED if timed else _NEEDED[:-1]:
            half, most = np.quantile([row[field] for row in rows], (0.5, 0.95))
            spreads.append(f'{half:.0f} / {most:.0f} {unit}')
        print(f'  needed, median / 95th percentile: {", ".join(spreads)}')
        shares = statistics.performance_profile(score, _PROFILE)
        profile = (
            f'{100 * share:.0f} % in {n}' for share, n in zip(shares, _PROFILE, strict=True)
        )
        print(f'  learned in so many paths: {", ".join(profile)}')
        improvement = statistics.probability_of_improvement
        for told, statistic, *groups in (
            ('paths, interquartile mean', statistics.interquartile_mean, score),
            (f'probability of fewer paths than {learners[0]}', improvement, score, scores[0]),
        ):
            low, high = statistics.bootstrap_interval(statistic, *groups, rng=rng)
            print(f'  {told}: {statistic(*groups):.2f} [{low:.2f}, {high:.2f}]')


def _scores(results: Sequence[dict[str, Any]], learner: str) -> FloatArray:
    """Return the paths needed, (runs, tasks); infinite where it was not learned."""
    tasks: dict[tuple[str, str], list[float]] = {}
    for row in results:
        if row['learner'] == learner:
            needed = row['paths'] if row['learned'] else np.inf
            tasks.setdefault((row['arena'], row['noise']), []).append(needed)
    runs = min(map(len, tasks.values()))
    return np.array([needed[:runs] for needed in tasks.values()]).T
