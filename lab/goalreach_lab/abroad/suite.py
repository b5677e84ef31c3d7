"""The abroad suite: our nodes in the MuJoCo world, case by case; docs/ABROAD.md."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import numpy as np

from goalreach_lab.options import DocumentOptions
from goalreach_lab.row import BenchRow
from goalreach_lab.study import Case, Result, Study, run_study
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.files import read_yaml
from goalreach_msgs_py.options import option
from goalreach_msgs_py.topics import LOCALIZER

SUMMARY = 'Drive in a world that shares no code with ours: examples/mujoco_world'

_STARTS: Final = {'border': 'paper', 'random': 'random:22'}
_WORLDS: Final = 4
"""Worlds of each case, of seeds that follow one another. Chosen: no image tells a shift and a turn
of all LEDs, so that in one world a single draw decides the NEES."""
_OUTCOMES: Final = ('goal', 'false-goal', 'bump', 'timeout', 'silent')
NEES_95: Final = 7.81
"""Exceeded by 5 % of consistent estimates: chi-square, 3 degrees of freedom."""


@dataclass(frozen=True, kw_only=True)
class Options(DocumentOptions):
    """Options of the suite."""

    case: tuple[str, ...] = option((), 'cases of cases.yaml (default: all)', metavar='CASE')
    starts: str = option('border', 'where paths begin', choices=(*_STARTS, 'both'))
    paths: int = option(4, 'paths of each case', minimum=1, maximum=22)


def execute(options: Options) -> list[BenchRow]:
    """Drive what is not driven yet; write the document and, beside it, the figure of the paths.

    Raises:
        GoalreachError: An option is refused or a file cannot be read or written.
    """
    known = read_yaml(Path(__file__).with_name('cases.yaml'))
    if unknown := set(options.case).difference(known):
        raise ConfigurationError('--case', min(unknown), f'one of {", ".join(known)}')
    if not (options.as_it_is or find_spec('mujoco')):
        raise GoalreachError("the package mujoco is missing: pip install 'goalreach[mujoco]'")
    study = Study(
        name='abroad',
        key=('case', 'world', 'starts', 'number'),
        cases=[
            {'case': case, 'world': world, 'starts': kind, 'number': (9 * path + 8) % 22}
            for case in options.case or known
            for world in range(_WORLDS)
            for kind in (_STARTS if options.starts == 'both' else (options.starts,))
            for path in range(world, options.paths, _WORLDS)
        ],
        measure=partial(_measure, known, options.seed),
        settings={'seed': options.seed},
    )
    results = run_study(study, options.results, measure=not options.as_it_is)
    if options.out is not None and results:
        _write(results, known, options, options.out)
    wrong = sum(path['outcome'] in {'false-goal', 'bump'} for path in results)
    short = sum(path['outcome'] != 'goal' for path in results) - wrong
    return [
        BenchRow.none_allowed('false goals and bumps', wrong, n=len(results)),
        BenchRow.none_allowed('other paths not to the goal', short, n=len(results)),
    ]


def _measure(known: Any, seed: int, cases: Sequence[Case]) -> Iterator[tuple[Case, Result]]:
    """Drive cases; all paths of a world that follow one another are driven in one graph."""
    from goalreach_evaluation.starts import choose_starts
    from goalreach_lab.abroad.ros_drive import WORLD, drive

    for (name, world), group in groupby(cases, lambda one: (one['case'], one['world'])):
        paths, case = list(group), known[name]
        drawn = {kind: choose_starts(word, Arena(), seed) for kind, word in _STARTS.items()}
        starts = [drawn[path['starts']][path['number']] for path in paths]
        driven = drive(
            case['world'].format(here=WORLD.parent).split(),
            {LOCALIZER: case.get('told', {})},
            starts,
            seed=seed + world,
        )
        yield from zip(paths, driven, strict=True)


def cells(paths: Sequence[Result]) -> list[str]:
    """Return the cells of a case: outcomes, position (in), NEES, share above (%), time (s)."""
    outcomes = [path['outcome'] for path in paths]
    times_s = [path['duration_s'] for path in paths if path['outcome'] == 'goal'] or [np.nan]
    errors = [error for path in paths for error in path['errors']] or [(np.nan, np.nan)]
    position_m, nees = np.array(errors).T
    p95_in, above = (
        np.percentile(position_m, 95) / INCH_M,
        100 * np.mean(np.heaviside(nees - NEES_95, 0)),
    )
    figures = {'.2f': p95_in, '.3g': nees.mean(), '.0f': above, '.1f': np.median(times_s)}
    counts = ' / '.join(str(outcomes.count(kind)) for kind in _OUTCOMES)
    return [counts, *('-' if np.isnan(x) else format(x, f) for f, x in figures.items())]


def _write(results: Sequence[Result], known: Any, options: Options, out: Path) -> None:
    from goalreach_evaluation.figures.figure_file import write_figure
    from goalreach_evaluation.figures.paper_figures import path_figure
    from goalreach_lab.template import write_document

    traces = [(path['trace'], path['outcome']) for path in results if 'trace' in path]
    paths = [(np.array(trace), end) for trace, end in traces]
    figure = path_figure(Arena(), paths, 'Paths with the full sensor chain (fuzzy, MuJoCo world)')
    write_figure(figure, out.parent / 'figures', 'abroad_paths')
    lines = [
        f'| {name} | {known[name]["world"]} | {" | ".join(cells(list(group)))} |'
        for name, group in groupby(results, lambda one: one['case'])
    ]
    seeds = {'seed': options.seed, 'last': options.seed + _WORLDS - 1, 'paths': options.paths}
    values = {**seeds, 'starts': options.starts, 'lines': '\n'.join(lines)}
    write_document(out, Path(__file__).with_name('abroad.md'), values)
