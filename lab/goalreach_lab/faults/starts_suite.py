"""Starts and stops of the whole stack: who survives its launcher, who disturbs the next start."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from goalreach_lab.row import BenchRow, Goal

if TYPE_CHECKING:
    from goalreach_lab.faults.start_rounds import Round


SUMMARY = 'Start and stop the stack by SIGINT, SIGTERM and SIGKILL of its launcher, in turn'


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    parser.add_argument('--times', type=int, default=12, metavar='N', help='starts and stops')
    parser.add_argument(
        '--results',
        type=Path,
        metavar='FILE',
        help='append each round as a JSON line, go on there',
    )


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Start, stop, and count.

    Raises:
        GoalreachError: An option is refused or a file cannot be written.
    """
    from goalreach_evaluation.summary_file import append_line, read_lines
    from goalreach_lab.faults.start_rounds import Round, run_rounds
    from goalreach_lab.rigs.stack import free_domains
    from goalreach_msgs_py.errors import ConfigurationError
    from goalreach_msgs_py.files import require_writable

    if options.times < 1:
        raise ConfigurationError('--times', options.times, 'a whole number >= 1')
    rounds: list[Round] = []
    if options.results is not None:
        rounds = [Round(**line) for line in read_lines(options.results)]
        require_writable(options.results)

    def keep(one: Round) -> None:
        rounds.append(one)
        if options.results is not None:
            append_line(options.results, one.to_json())

    rng = np.random.default_rng([options.seed, len(rounds)])
    left = run_rounds(
        max(0, options.times - len(rounds)), domain=free_domains(1)[0], rng=rng, keep=keep
    )
    return [
        _row('processes that survived their launcher', sum(r.survivors for r in rounds), rounds),
        _row('starts that did not drive a path', sum(not r.drove for r in rounds), rounds),
        _row('abandoned files in shared memory after the last stop', left, rounds),
    ]


def _row(name: str, ours: float, rounds: list[Round]) -> BenchRow:
    early = sum(r.early for r in rounds)
    note = f'{early} of them ended while they came up'
    goal = Goal(of='ours', relation='<=', bound=0.0)
    return BenchRow(name=name, unit='', ours=ours, goal=goal, n=len(rounds), note=note)
