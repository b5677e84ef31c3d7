"""All rows of speed, ours against floors and peers, and the document that explains them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import importlib
from itertools import chain
from pathlib import Path
import time
from typing import Final

from goalreach_lab.options import BenchOptions
from goalreach_lab.report import bench_table, goals_met, machine
from goalreach_lab.row import BenchRow
from goalreach_lab.speed.measurement import Budget
from goalreach_lab.template import table, write_document
from goalreach_msgs_py.files import require_writable
from goalreach_msgs_py.options import option

SUMMARY = 'How fast everything is, against floors and peers: what `bench` does without a suite'

GROUPS: Final[Mapping[str, str]] = {
    'lockstep': 'graph_rows.lockstep_rows', 'real-time': 'graph_rows.real_time_rows',
    'start': 'graph_rows.start_rows', 'readers': 'graph_rows.reader_rows',
    'learning': 'core_rows.learning_rows', 'driving': 'driving.driving_rows',
    'localization': 'core_rows.localization_rows', 'recording': 'core_rows.recording_rows',
    'evaluation': 'core_rows.evaluation_rows',
}  # fmt: skip
"""Module and function of each group of rows that are measured together."""

_TEMPLATE: Final = Path(__file__).with_name('performance.md')
_PROFILED_PATHS: Final = 22


@dataclass(frozen=True, kw_only=True)
class Options(BenchOptions):
    """Options of the suite."""

    scale: float = option(1.0, 'factor on the extent of every measurement', above=0.0)
    only: tuple[str, ...] = option(
        (), f'only some of the groups {", ".join(GROUPS)}', choices=tuple(GROUPS), metavar='GROUP'
    )
    out: Path | None = option(None, 'write the document, in Markdown')


def execute(options: Options) -> list[BenchRow]:
    """Measure group by group.

    Raises:
        GoalreachError: A file cannot be written, or a graph under test does not come up.
    """
    if options.out is not None:
        require_writable(options.out)
    budget = Budget(seed=options.seed, scale=options.scale)
    rows: dict[str, list[BenchRow]] = {}
    for name in options.only or GROUPS:
        began_s = time.perf_counter()
        rows[name] = rows_of(name, budget)
        print(f'{name}: {time.perf_counter() - began_s:.0f} s', flush=True)
    if options.out is not None:
        write_performance(options.out, rows, budget)
    return [row for group in rows.values() for row in group]


def rows_of(name: str, budget: Budget) -> list[BenchRow]:
    """Measure one group."""
    module, _, function = GROUPS[name].partition('.')
    found = importlib.import_module(f'goalreach_lab.speed.{module}')
    measure: Callable[[Budget], list[BenchRow]] = getattr(found, function)
    return measure(budget)


def write_performance(path: Path, rows: Mapping[str, Sequence[BenchRow]], budget: Budget) -> None:
    """Write docs/PERFORMANCE.md with the groups that were measured.

    Args:
        path: The file.
        rows: Rows by group.
        budget: Seed and extent they were measured with.

    Raises:
        FileFormatError: It cannot be written.
    """
    scale = '' if budget.scale == 1.0 else f' --scale {budget.scale:g}'
    tables = {name: bench_table(rows[name]) if name in rows else None for name in GROUPS}
    values = {
        'options': f'--seed {budget.seed}{scale}',
        'machine': machine(),
        'goals_met': goals_met(chain.from_iterable(rows.values())),
        'profile': _profile_table(budget) if 'driving' in rows else None,
        **{name.replace('-', '_'): text for name, text in tables.items()},
    }
    write_document(path, _TEMPLATE, values)


def _profile_table(budget: Budget) -> str:
    """Return the shares of the modules in the time of a frame."""
    from goalreach_lab.speed.driving import profile_driving

    shares = profile_driving(budget.seed, paths=budget.count(_PROFILED_PATHS))
    cells = [(share.module, f'{share.percent:.1f} %') for share in shares]
    return table(('module', 'share'), cells)
