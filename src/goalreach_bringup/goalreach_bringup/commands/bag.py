"""The `bag` command: what is in a bag, without a graph."""

from __future__ import annotations

import argparse
from pathlib import Path

__all__ = ['SUMMARY', 'configure', 'execute']

SUMMARY = 'Look into a bag: info, compare, plot, export'


def configure(parser: argparse.ArgumentParser) -> None:
    """Add one sub-command per verb."""
    verbs = parser.add_subparsers(dest='verb', metavar='VERB', required=True)
    compare = verbs.add_parser(
        'compare', help='whether two bags hold the same messages, and where they first differ'
    )
    compare.add_argument('bag', type=Path, metavar='A')
    compare.add_argument('other', type=Path, metavar='B')
    compare.add_argument('--topics', nargs='+', default=(), metavar='NAME', help='only these')
    compare.add_argument(
        '--exclude',
        action='append',
        metavar='PATTERN',
        help='topics to leave out (default: /rosout and /parameter_events)',
    )


def execute(options: argparse.Namespace) -> int:
    """Do what the verb says.

    Raises:
        GoalreachError: A bag cannot be read, or a file cannot be written.
    """
    return _compare(options)


def _compare(options: argparse.Namespace) -> int:
    """Print a table; return 1 where the bags differ."""
    from goalreach_bringup.bags.bag_reader_file import BagReader
    from goalreach_bringup.bags.compare import WALL_CLOCK_TOPICS, compare_bags
    from goalreach_bringup.bags.report import show_comparison
    from goalreach_bringup.bags.selection import TopicSelection

    exclude = options.exclude or [f'^{name}$' for name in WALL_CLOCK_TOPICS]
    selection = TopicSelection(names=tuple(options.topics), exclude=tuple(exclude))
    with BagReader(options.bag) as first, BagReader(options.other) as second:
        comparisons = compare_bags(first, second, selection.includes)
    show_comparison(comparisons)
    return 0 if all(comparison.same for comparison in comparisons) else 1
