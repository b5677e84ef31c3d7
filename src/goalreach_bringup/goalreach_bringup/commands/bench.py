"""The `bench` command: figures of ours beside floors and peers, measured in the same run."""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path
import pkgutil
from types import ModuleType
from typing import Any

from goalreach_bringup import bench

__all__ = ['SUMMARY', 'configure', 'execute', 'suites']

SUMMARY = 'Measure this machine against floors and peers; studies behind the documents'

_HELPERS = ('row', 'report')
_DEFAULT = 'performance'


def suites() -> list[str]:
    """Return the names of the suites: the modules of `goalreach_bringup.bench`."""
    modules = pkgutil.iter_modules(bench.__path__)
    return [m.name for m in modules if not m.ispkg and m.name not in _HELPERS]


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
    for name in suites():
        suite = _load(name)
        sub = choice.add_parser(
            name.replace('_', '-'),
            help=suite.SUMMARY,
            description=suite.SUMMARY,
            formatter_class=argparse.ArgumentDefaultsHelpFormatter,
        )
        sub.add_argument('--json', **json_option)
        suite.configure(sub)


def _load(name: str) -> ModuleType:
    return importlib.import_module(f'goalreach_bringup.bench.{name}')


def execute(options: argparse.Namespace) -> int:
    """Run a suite; return 0 where every row with a goal meets it, else 1.

    Raises:
        GoalreachError: An option is refused or a file cannot be written.
    """
    from goalreach_bringup.bench.report import rows_to_json, show_rows
    from goalreach_bringup.summary_file import write_summary
    from goalreach_bringup.terminal import at_work
    from goalreach_msgs_py.atomic_file import require_writable

    if options.json is not None:
        require_writable(options.json)
    suite = options.suite or _DEFAULT
    with at_work(f'bench {suite}'):
        rows = _load(suite.replace('-', '_')).execute(options)
    show_rows(rows)
    if options.json is not None:
        write_summary(options.json, rows_to_json(rows, seed=options.seed))
    return 1 if any(row.met is False for row in rows) else 0
