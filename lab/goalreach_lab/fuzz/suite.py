"""Bad input for every reader of files, parameters, options and messages."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
import os
from pathlib import Path
import sys
import tempfile

import numpy as np

from goalreach_lab.fuzz.guided import GUIDED, is_guided_installed, run_guided
from goalreach_lab.fuzz.reader import Reader, Tally, try_inputs
from goalreach_lab.options import BenchOptions
from goalreach_lab.row import BenchRow
from goalreach_lab.study import Case, Result, Study, find, per_case
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.options import option

SUMMARY = 'Feed every reader bad input: one clear line each, no traceback, hang or invalid value'

_SHOWN = 5
_CHUNK = 500
_GUIDED = ', guided'


@dataclass(frozen=True, kw_only=True)
class Options(BenchOptions):
    """Options of the suite."""

    examples: int = option(2000, 'inputs over all readers', minimum=1)
    readers: str = option('', 'only readers with one of these words, by comma', metavar='WORDS')
    guided: int = option(
        0, 'further inputs for each file reader, by atheris where it is installed', minimum=0
    )
    results: Path | None = option(None, 'keep counts there, and resume', metavar='DIR')


def execute(options: Options) -> list[BenchRow]:
    """Feed the readers, and report their tallies.

    Raises:
        GoalreachError: An option is refused, or a file of results is refused.
    """
    os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'
    from goalreach_lab.fuzz.ros_messages import all_readers

    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        readers = all_readers(Path(folder))
        study = Study(
            name='fuzz',
            key=('reader', 'first', 'count'),
            cases=[*_cases(options, readers), *_guided_cases(options)],
            measure=per_case(partial(_measure, readers=readers, seed=options.seed)),
            settings={'seed': options.seed},
            analyse=add_up,
        )
        tallies: list[Tally] = find(study, options.results)
    for tally in tallies:
        for seed, text in tally.tracebacks[:_SHOWN]:
            sys.stderr.write(f'{tally.name}, seed {seed}: {text}\n')
        for seed in tally.hangs[:_SHOWN]:
            sys.stderr.write(f'{tally.name}, seed {seed}: took too long\n')
    return _rows(tallies)


def _cases(options: Options, readers: Sequence[Reader]) -> list[dict[str, object]]:
    """Return the inputs of each chosen reader in chunks."""
    words = [word.strip() for word in options.readers.split(',') if word.strip()]
    names = [r.name for r in readers if not words or any(word in r.name for word in words)]
    if not names:
        raise ConfigurationError('--readers', options.readers, 'a word of the name of a reader')
    each = -(-options.examples // len(names))
    return [
        {'reader': name, 'first': first, 'count': min(_CHUNK, each - first)}
        for name in names
        for first in range(0, each, _CHUNK)
    ]


def _guided_cases(options: Options) -> list[dict[str, object]]:
    if not options.guided:
        return []
    if not is_guided_installed():
        sys.stderr.write('--guided: skipped, atheris is not installed (extra "fuzz")\n')
        return []
    return [{'reader': n + _GUIDED, 'first': 0, 'count': options.guided} for n in GUIDED]


def _measure(case: Case, *, readers: Sequence[Reader], seed: int) -> dict[str, object]:
    """Return the tally of a case."""
    first, count = case['first'], case['count']
    name = case['reader'].removesuffix(_GUIDED)
    if name != case['reader']:
        with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
            return asdict(run_guided(name, runs=count, seed=seed, folder=Path(folder)))
    index = [reader.name for reader in readers].index(name)
    seeds = np.random.SeedSequence([seed, index]).generate_state(first + count).tolist()
    return asdict(try_inputs(readers[index], seeds[first:]))


def add_up(results: Sequence[Result]) -> list[Tally]:
    """Return the tally of each reader over all its cases."""
    tallies: dict[str, Tally] = {}
    for result in results:
        counts = {field.name: result[field.name] for field in fields(Tally)}
        tally = Tally(**counts)
        tallies.setdefault(tally.name, Tally(tally.name)).add(tally)
    return list(tallies.values())


def _rows(tallies: Sequence[Tally]) -> list[BenchRow]:
    rows = [
        BenchRow.none_allowed(
            tally.name,
            len({*tally.hangs, *(seed for seed, _ in tally.tracebacks)}),
            unit='tracebacks or invalid values',
            n=tally.inputs,
            note=f'{tally.refused} refused, {tally.accepted} accepted, {len(tally.hangs)} hangs',
        )
        for tally in tallies
    ]
    total = BenchRow.none_allowed(
        'all readers',
        sum(row.ours for row in rows),
        unit='tracebacks, invalid values or hangs',
        n=sum(row.n for row in rows),
    )
    return [*rows, total]
