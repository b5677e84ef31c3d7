"""The `bench` command of an installed goalreach: says where the benchmarks are."""

from __future__ import annotations

import argparse

from goalreach_msgs_py.errors import GoalreachError

SUMMARY = 'Benchmarks and studies of goalreach itself; in a clone of the source only'


def configure(parser: argparse.ArgumentParser) -> None:
    """Accept any arguments."""
    parser.add_argument('arguments', nargs=argparse.REMAINDER, help='of scripts/bench.py')


def execute(options: argparse.Namespace) -> int:  # noqa: ARG001 - every command has them
    """Refuse.

    Raises:
        GoalreachError: Always.
    """
    raise GoalreachError(
        'the benchmarks come with the source: clone the repository, then run '
        '`python3 scripts/bench.py` there'
    )
