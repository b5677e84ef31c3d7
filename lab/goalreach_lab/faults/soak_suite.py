"""Hours of simulated driving with random faults: what each process holds must not grow."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import contextlib
import sys
from typing import TYPE_CHECKING, Final

from goalreach_lab.row import BenchRow, Goal

if TYPE_CHECKING:
    from goalreach_lab.faults.growth import Growth, Sample


SUMMARY = 'Drive for hours with random faults; memory, handles and shared memory must stay flat'

_SETTLED_S: Final = 900.0
_GROWTH: Final = 0.02


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    add = parser.add_argument
    add('--hours', type=float, default=2.0, metavar='F', help='simulated hours')
    add('--clock', choices=('lockstep', 'realtime'), default='lockstep', help='how time passes')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Drive.

    Raises:
        GoalreachError: An option is refused, or the stack does not go on.
    """
    from goalreach_lab.faults.growth import files_gained, growths
    from goalreach_lab.faults.ros_soak import drive_for_hours
    from goalreach_lab.rigs.stack import free_domains
    from goalreach_msgs_py.errors import ConfigurationError

    if not 0.0 < options.hours <= 1000.0:  # noqa: PLR2004 - 24 h a day
        raise ConfigurationError('--hours', options.hours, 'a number in (0, 1000]')
    samples: list[Sample] = []
    faults: list[str] = []

    def tell(clock_s: float, name: str) -> None:
        faults.append(name)
        sys.stderr.write(f'{clock_s:8.1f} s  {name}\n')

    with contextlib.suppress(KeyboardInterrupt):  # what has been seen by then is worth its rows
        drive_for_hours(
            options.hours,
            domain=free_domains(1)[0],
            seed=options.seed,
            lockstep=options.clock == 'lockstep',
            keep=samples.append,
            tell=tell,
        )
    driven_h = max((sample.clock_s for sample in samples), default=0.0) / 3600.0
    settled_s = min(_SETTLED_S, 0.25 * 3600.0 * options.hours)
    rows = [row for one in growths(samples, settled_s) for row in _rows(one)]
    return [
        BenchRow(name='faults', unit='', ours=len(faults), note=f'in {driven_h:.2f} h simulated'),
        *rows,
        _flat('files in shared memory, gained', files_gained(samples, settled_s), len(samples)),
    ]


def _rows(one: Growth) -> Sequence[BenchRow]:
    note = f'{one.memory_mb:.1f} MB at the end, {one.span_s / 60:.0f} min compared'
    return [
        BenchRow(
            name=f'{one.name}, memory gained',
            unit='%',
            ours=100.0 * one.memory_share,
            goal=Goal(of='ours', relation='<=', bound=100.0 * _GROWTH),
            n=one.samples,
            note=note,
        ),
        _flat(f'{one.name}, handles gained', one.handles, one.samples),
        _flat(f'{one.name}, threads gained', one.threads, one.samples),
        _flat(f'{one.name}, shared-memory files gained', one.shared_files, one.samples),
    ]


def _flat(name: str, ours: float, samples: int) -> BenchRow:
    goal = Goal(of='ours', relation='<=', bound=0.0)
    return BenchRow(name=name, unit='', ours=ours, goal=goal, n=samples)
