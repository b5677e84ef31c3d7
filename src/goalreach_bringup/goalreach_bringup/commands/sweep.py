"""The `sweep` command: seeds x noise x arenas, on processes or on a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass
import functools
from pathlib import Path
from typing import Any

import goalreach_evaluation as evaluation
from goalreach_learning.blending import MODES
from goalreach_msgs_py.options import REQUIRED, SeededOptions, option

SUMMARY = 'Learn and drive over seeds x noise x arenas, on processes or on a Dask cluster'


@dataclass(frozen=True, kw_only=True)
class Options(SeededOptions):
    """Options of the command."""

    results: Path = option(REQUIRED, 'append a JSON line for each case')
    arenas: tuple[str, ...] = option(('paper',), 'where to drive', metavar='NAME|FILE')
    noise: tuple[str, ...] = option(('nominal',), 'sensor errors', metavar='NAME|FILE')
    seeds: int = option(10, 'number of seeds, counted up from --seed', minimum=1)
    drives: int = option(22, 'random starts of each case', minimum=1)
    mode: str = option('fuzzy', 'how the heading is chosen', choices=MODES)
    jobs: int = option(1, 'processes, or workers on this machine', minimum=1)
    engine: str = option('processes', 'what runs the cases', choices=('processes', 'dask'))
    scheduler: str | None = option(None, 'address of a running Dask scheduler', metavar='ADDRESS')


def execute(options: Options) -> int:
    """Run what the file of results does not hold yet; print the shares.

    Raises:
        GoalreachError: An option or a file is refused, or workers keep dying.
    """
    from goalreach_evaluation.sweep import KEY
    from goalreach_msgs_py.files import require_writable

    require_writable(options.results)
    cases = _cases(options)
    results = evaluation.ResultsFile(options.results, key=KEY)
    left = [case for case in cases if results.missing([case.key])]
    print(f'{len(cases) - len(left)} of {len(cases)} cases are done', flush=True)
    for case, result in evaluation.run_cases(left, evaluation.drive_case, _executor(options)):
        results.add(case.key, result)
    _show(results.results)
    return 0


def _cases(options: Options) -> list[evaluation.SweepCase]:
    return [
        evaluation.SweepCase(
            arena_name=arena,
            arena=evaluation.choose_arena(arena),
            noise_name=noise,
            noise=evaluation.choose_noise(noise),
            mode=options.mode,
            drives=options.drives,
            seed=options.seed + number,
        )
        for arena in options.arenas
        for noise in options.noise
        for number in range(options.seeds)
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

    table = Table('arena', 'noise', 'mode', 'seeds', 'paths', 'to the goal', '95 % interval')
    groups: dict[tuple[str, str, str], list[dict[str, int]]] = {}
    for result in results:
        key = (result['arena'], result['noise'], result['mode'])
        groups.setdefault(key, []).append(result['outcomes'])
    for key, outcomes in groups.items():
        paths = sum(sum(one.values()) for one in outcomes)
        goals = sum(one.get('goal', 0) for one in outcomes)
        low, high = evaluation.wilson_interval(goals, paths)
        share = f'{100 * goals / paths:.2f} %'
        interval = f'{100 * low:.2f} to {100 * high:.2f} %'
        table.add_row(*key, str(len(outcomes)), str(paths), share, interval)
    Console(highlight=False).print(table)
