"""The `bench` command: figures of ours beside floors and peers, measured in the same run."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
import importlib
from pathlib import Path
import sys
from types import ModuleType
from typing import Any, Final

from goalreach_bringup import cli

SUMMARY = 'Measure this machine against floors and peers; studies behind the documents'

SUITES: Final[Mapping[str, str]] = {
    'performance': 'speed.suite',
    'driving': 'reproduction.driving',
    'faults': 'faults.suite',
    'frames': 'speed.frames',
    'fuzz': 'fuzz.suite',
    'learning': 'reproduction.learning',
    'learning-peers': 'speed.learning_peers',
    'localization': 'localization.suite',
    'page': 'speed.page',
    'page-day': 'speed.page_day',
    'recording': 'speed.recording',
    'reproduction': 'reproduction.suite',
    'simulator': 'speed.simulator',
    'soak': 'faults.soak_suite',
    'starts': 'faults.starts_suite',
}
"""Module of each suite; each has SUMMARY, `configure` and `execute`."""

_DEFAULT = 'performance'


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one suite; return the exit status.

    Args:
        arguments: Of the command line, or None for the process's own.
    """
    given = sys.argv[1:] if arguments is None else arguments
    return cli.run_command(sys.modules[__name__], 'bench', given)


def configure(parser: argparse.ArgumentParser) -> None:
    """Add one sub-command per suite, each with its own options; without one, those of all rows."""
    json_option: dict[str, Any] = {
        'type': Path,
        'metavar': 'FILE',
        'help': 'write the rows as JSON',
    }
    parser.add_argument('--json', **json_option)
    _load(_DEFAULT).configure(parser)
    choice = parser.add_subparsers(dest='suite', metavar='SUITE')
    for name in SUITES:
        suite = _load(name)
        sub = choice.add_parser(
            name,
            help=suite.SUMMARY,
            description=suite.SUMMARY,
            formatter_class=argparse.ArgumentDefaultsHelpFormatter,
        )
        sub.add_argument('--json', **json_option)
        suite.configure(sub)


def _load(name: str) -> ModuleType:
    return importlib.import_module(f'goalreach_lab.{SUITES[name]}')


def execute(options: argparse.Namespace) -> int:
    """Run a suite; return 0 where every row with a goal meets it, else 1.

    Raises:
        GoalreachError: An option is refused or a file cannot be written.
    """
    from goalreach_evaluation.summary_file import write_summary
    from goalreach_evaluation.terminal import at_work
    from goalreach_lab.report import rows_to_json, show_rows
    from goalreach_msgs_py.files import require_writable

    if options.json is not None:
        require_writable(options.json)
    suite = options.suite or _DEFAULT
    with at_work(f'bench {suite}'):
        rows = _load(suite).execute(options)
    show_rows(rows)
    if options.json is not None:
        write_summary(options.json, rows_to_json(rows, seed=options.seed))
    return 1 if any(row.met is False for row in rows) else 0
