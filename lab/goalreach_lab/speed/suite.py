"""All rows of speed: ours beside floors and peers, and the document that explains them."""

from __future__ import annotations

import argparse
from pathlib import Path
import time

from goalreach_lab.row import BenchRow

SUMMARY = 'How fast everything is, beside floors and peers: what `bench` does without a suite'


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    from goalreach_lab.speed.groups import GROUPS

    add = parser.add_argument
    add('--scale', type=float, default=1.0, help='factor on what is measured, and on the time')
    add(
        '--only',
        nargs='+',
        choices=list(GROUPS),
        metavar='GROUP',
        help=f'only these groups of rows: {", ".join(GROUPS)}',
    )
    add('--out', type=Path, metavar='FILE', help='write the document, in Markdown')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Measure group by group.

    Raises:
        GoalreachError: An option is refused, a file cannot be written, or a graph under test
            does not come up.
    """
    from goalreach_lab.speed.document import write_document
    from goalreach_lab.speed.groups import GROUPS, rows_of
    from goalreach_lab.speed.measurement import Budget
    from goalreach_msgs_py.errors import ConfigurationError
    from goalreach_msgs_py.files import require_writable

    if not options.scale > 0.0:
        raise ConfigurationError('--scale', options.scale, 'a number above 0')
    if options.out is not None:
        require_writable(options.out)
    budget = Budget(seed=options.seed, scale=options.scale)
    rows: dict[str, list[BenchRow]] = {}
    for name in options.only or GROUPS:
        began_s = time.perf_counter()
        rows[name] = rows_of(name, budget)
        print(f'{name}: {time.perf_counter() - began_s:.0f} s', flush=True)
    if options.out is not None:
        write_document(options.out, rows, budget)
    return [row for group in rows.values() for row in group]
