"""The `bench` command: benchmarks against floors and peers, and the studies of the documents."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
import importlib
import sys
from typing import Any, Final

from rich.console import Console

from goalreach_bringup import cli
from goalreach_bringup.command import Command
from goalreach_lab.options import BenchOptions
from goalreach_lab.row import BenchRow

SUMMARY = 'Benchmarks against floors and peers of the same run, and the studies of the documents'

SUITES: Final[Mapping[str, str]] = {
    'performance': 'speed.suite', 'all': 'everything', 'abroad': 'abroad.suite',
    'faults': 'faults.suite', 'fuzz': 'fuzz.suite', 'learners': 'learners.suite',
    'learning-peers': 'speed.learning_peers', 'localization': 'localization.suite',
    'mutation': 'mutation', 'obstacles': 'behaviors.suite', 'page': 'speed.dashboard',
    'page-day': 'speed.dashboard_day', 'recording': 'speed.recording',
    'reproduction': 'reproduction.suite', 'soak': 'faults.soak', 'starts': 'faults.starts',
}  # fmt: skip
"""Module of each suite, with `SUMMARY`, `Options` and `execute(options)`, which returns rows."""

_DEFAULT = 'performance'


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one suite; return the exit status.

    Args:
        arguments: Arguments of the command line, or None for those of the process.
    """
    given = sys.argv[1:] if arguments is None else arguments
    return cli.guarded('goalreach bench', lambda: command().run('goalreach bench', given))


def command() -> Command:
    """Return the command with all suites."""
    suites = {name: _load(name) for name in SUITES}
    return replace(suites[_DEFAULT], summary=SUMMARY, subcommands=suites)


def _load(name: str) -> Command:
    suite = importlib.import_module(f'goalreach_lab.{SUITES[name]}')
    return Command(
        summary=suite.SUMMARY,
        options=suite.Options,
        execute=partial(_execute, name, suite.execute),
    )


def _execute(name: str, execute: Callable[[Any], list[BenchRow]], options: BenchOptions) -> int:
    """Run a suite; return 0 where every row with a goal meets it, else 1.

    Raises:
        GoalreachError: An option is refused or a file cannot be written.
    """
    from goalreach_evaluation.summary_file import write_summary
    from goalreach_lab.report import rows_to_json, show_rows
    from goalreach_msgs_py.files import require_writable

    if options.json is not None:
        require_writable(options.json)
    with Console(stderr=True).status(f'bench {name}'):
        rows = execute(options)
    if rows:
        show_rows(rows)
    if options.json is not None:
        write_summary(options.json, rows_to_json(rows, seed=options.seed))
    return 1 if any(row.met is False for row in rows) else 0
