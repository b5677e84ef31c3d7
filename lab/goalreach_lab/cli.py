"""The `bench` command: figures of ours beside floors and peers, measured in the same run."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
import importlib
from pathlib import Path
import sys
from typing import Any, Final

from goalreach_bringup import cli
from goalreach_bringup.command import Command
from goalreach_lab.row import BenchRow

SUMMARY = 'Measure this machine against floors and peers; studies behind the documents'

SUITES: Final[Mapping[str, str]] = {
    'performance': 'speed.suite',
    'driving': 'reproduction.driving',
    'faults': 'faults.suite',
    'frames': 'speed.driving',
    'fuzz': 'fuzz.suite',
    'learning': 'reproduction.learning',
    'learning-peers': 'speed.learning_peers',
    'localization': 'localization.suite',
    'page': 'speed.dashboard',
    'page-day': 'speed.dashboard_day',
    'recording': 'speed.recording',
    'reproduction': 'reproduction.suite',
    'simulator': 'speed.simulator',
    'soak': 'faults.soak',
    'starts': 'faults.starts',
}
"""Module of each suite.

Each has `SUMMARY`, `Options`, a subclass of `BenchOptions`, and `execute(options)`, which returns
the rows; a suite may still have `configure(parser)` in place of `Options`.
"""

_DEFAULT = 'performance'


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one suite; return the exit status.

    Args:
        arguments: Of the command line, or None for the process's own.
    """
    given = sys.argv[1:] if arguments is None else arguments
    suites = {name: _load(name) for name in SUITES}
    command = replace(suites[_DEFAULT], summary=SUMMARY, subcommands=suites)
    return cli.run_command(command, 'bench', given)


def _load(name: str) -> Command:
    suite = importlib.import_module(f'goalreach_lab.{SUITES[name]}')
    options = getattr(suite, 'Options', None)
    return Command(
        summary=suite.SUMMARY,
        options=options,
        execute=partial(_execute, name, suite.execute),
        configure=None if options else partial(_configure, suite.configure),
    )


def _configure(
    configure: Callable[[argparse.ArgumentParser], None], parser: argparse.ArgumentParser
) -> None:
    parser.add_argument('--json', type=Path, default=argparse.SUPPRESS, metavar='FILE')
    configure(parser)


def _execute(
    name: str,
    execute: Callable[[Any], list[BenchRow]],
    options: Any,
) -> int:
    """Run a suite; return 0 where every row with a goal meets it, else 1.

    Raises:
        GoalreachError: An option is refused or a file cannot be written.
    """
    from goalreach_evaluation.summary_file import write_summary
    from goalreach_lab.report import at_work, rows_to_json, show_rows
    from goalreach_msgs_py.files import require_writable

    options.__dict__.setdefault('seed', 0)
    json = getattr(options, 'json', None)
    if json is not None:
        require_writable(json)
    with at_work(f'bench {name}'):
        rows = execute(options)
    show_rows(rows)
    if json is not None:
        write_summary(json, rows_to_json(rows, seed=options.seed))
    return 1 if any(row.met is False for row in rows) else 0
