"""Bad input by the ten thousand for every reader of files, parameters, options and messages."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import sys
import tempfile
from typing import TYPE_CHECKING

import numpy as np

from goalreach_lab.row import BenchRow, Goal

if TYPE_CHECKING:
    from goalreach_lab.fuzz.reader import Tally
    from goalreach_lab.fuzz.tally_file import TallyFile


SUMMARY = 'Feed every reader bad input; one clear line each, no traceback, no hang, no nonsense'

_SHOWN = 5
_CHUNK = 500


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    add = parser.add_argument
    add('--examples', type=int, default=2000, metavar='N', help='inputs over all readers')
    add('--readers', default='', metavar='WORDS', help='only readers with one of these words')
    add(
        '--guided',
        type=int,
        default=0,
        metavar='N',
        help='further inputs for each file reader, chosen by atheris where it is installed',
    )
    add('--results', type=Path, metavar='FILE', help='keep counts there, and go on from them')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Feed them.

    Raises:
        GoalreachError: An option is refused.
    """
    os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'
    from goalreach_evaluation.terminal import progress_bar
    from goalreach_lab.fuzz.reader import try_inputs
    from goalreach_lab.fuzz.ros_readers import all_readers
    from goalreach_lab.fuzz.tally_file import TallyFile
    from goalreach_msgs_py.errors import ConfigurationError

    for name, least in (('examples', 1), ('guided', 0)):
        if getattr(options, name) < least:
            raise ConfigurationError(f'--{name}', getattr(options, name), f'at least {least}')
    words = [word.strip() for word in options.readers.split(',') if word.strip()]
    done = TallyFile(options.results)
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        readers = all_readers(Path(folder))
        chosen = [r for r in readers if not words or any(word in r.name for word in words)]
        if not chosen:
            raise ConfigurationError(
                '--readers', options.readers, 'a word of the name of a reader'
            )
        each = -(-options.examples // len(chosen))
        with progress_bar('readers', total=len(chosen)) as advance:
            for reader in chosen:
                sequence = np.random.SeedSequence([options.seed, readers.index(reader)])
                seeds = sequence.generate_state(each).tolist()
                while rest := seeds[done.of(reader.name).inputs :]:
                    done.add(try_inputs(reader, rest[:_CHUNK]))
                advance(1)
    if options.guided:
        _guide(options, done)
    tallies = list(done.tallies.values())
    for tally in tallies:
        for seed, text in tally.tracebacks[:_SHOWN]:
            sys.stderr.write(f'{tally.name}, seed {seed}: {text}\n')
        for seed in tally.hangs[:_SHOWN]:
            sys.stderr.write(f'{tally.name}, seed {seed}: took too long\n')
    return [*(_row(tally) for tally in tallies), _total(tallies)]


def _guide(options: argparse.Namespace, done: TallyFile) -> None:
    """Let atheris choose further inputs for the readers of files."""
    from goalreach_lab.fuzz.guided import GUIDED, is_guided_installed, run_guided

    if not is_guided_installed():
        sys.stderr.write('--guided: skipped, atheris is not installed (extra "fuzz")\n')
        return
    for name in GUIDED:
        if done.of(f'{name}, guided').inputs >= options.guided:
            continue
        with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
            done.add(run_guided(name, runs=options.guided, seed=options.seed, folder=Path(folder)))


def _row(tally: Tally) -> BenchRow:
    return BenchRow(
        name=tally.name,
        unit='tracebacks or nonsense',
        ours=len(tally.tracebacks) + len(tally.hangs),
        goal=Goal(of='ours', relation='<=', bound=0.0),
        n=tally.inputs,
        note=f'{tally.refused} refused, {tally.accepted} accepted, {len(tally.hangs)} hangs',
    )


def _total(tallies: list[Tally]) -> BenchRow:
    bad = sum(len(tally.tracebacks) + len(tally.hangs) for tally in tallies)
    return BenchRow(
        name='all readers',
        unit='tracebacks, nonsense or hangs',
        ours=bad,
        goal=Goal(of='ours', relation='<=', bound=0.0),
        n=sum(tally.inputs for tally in tallies),
    )
