"""The `sweep` command: seeds x noise x arenas, on processes or on a Dask cluster."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

from goalreach_bringup.launch.options import MODES
from goalreach_msgs_py.errors import ConfigurationError

if TYPE_CHECKING:
    from goalreach_evaluation.sweep import SweepCase


SUMMARY = 'Learn and drive over seeds x noise x arenas, on processes or on a Dask cluster'


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add('--results', type=Path, required=True, metavar='FILE', help='a JSON line for each case')
    add('--arenas', nargs='+', default=['paper'], metavar='NAME|FILE', help='where to drive')
    add('--noise', nargs='+', default=['nominal'], metavar='NAME|FILE', help='sensor errors')
    add('--seeds', type=int, default=10, metavar='N', help='seeds, from --seed on')
    add('--drives', type=int, default=22, metavar='N', help='random starts of each case')
    add('--mode', choices=MODES, default='fuzzy', help='how the heading is chosen')
    add('--jobs', type=int, default=1, metavar='N', help='processes, or workers on this machine')
    add('--engine', choices=('processes', 'dask'), default='processes', help='what runs it')
    add('--scheduler', metavar='ADDRESS', help='a Dask scheduler that runs already')


def execute(options: argparse.Namespace) -> int:
    """Run what the file of results does not hold yet; print the shares.

    Raises:
        GoalreachError: An option or a file is refused, or workers keep dying.
    """
    from goalreach_evaluation.results_file import ResultsFile
    from goalreach_evaluation.sweep import KEY, drive_case, run_cases
    from goalreach_msgs_py.files import require_writable

    for name in ('seeds', 'drives', 'jobs'):
        if getattr(options, name) < 1:
            raise ConfigurationError(f'--{name}', getattr(options, name), 'a whole number >= 1')
    require_writable(options.results)
    cases = _cases(options)
    results = ResultsFile(options.results, key=KEY)
    left = [case for case in cases if results.missing([case.key])]
    print(f'{len(cases) - len(left)} of {len(cases)} cases are done', flush=True)
    for case, result in run_cases(left, drive_case, _executor(options)):
        results.add(case.key, result)
    _show(results.results)
    return 0


def _cases(options: argparse.Namespace) -> list[SweepCase]:
    from goalreach_evaluation.choices import choose_arena, choose_noise
    from goalreach_evaluation.sweep import SweepCase

    return [
        SweepCase(
            arena_name=arena,
            arena=choose_arena(arena),
            noise_name=noise,
            noise=choose_noise(noise),
            mode=options.mode,
            drives=options.drives,
            seed=options.seed + number,
        )
        for arena in options.arenas
        for noise in options.noise
        for number in range(options.seeds)
    ]


def _executor(options: argparse.Namespace) -> Callable[[], AbstractContextManager[Executor]]:
    from goalreach_evaluation.sweep import dask_workers, processes

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
