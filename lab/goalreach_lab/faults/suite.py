"""Faults injected into live stacks: bumps, wrong poses, hangs, times to recover, names."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
import multiprocessing
from pathlib import Path
import tempfile
from typing import TYPE_CHECKING, Final

import numpy as np

from goalreach_lab.row import BenchRow, Goal

if TYPE_CHECKING:
    from goalreach_lab.faults.document import KindSummary
    from goalreach_lab.faults.judge import Verdict
    from goalreach_lab.faults.kinds import FaultKind


SUMMARY = 'Inject faults into a live stack: what should come of each, what does, time to recover'

_RECOVERY_S: Final = 3.0
_STOP_S: Final = 0.6


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    add = parser.add_argument
    add(
        '--kinds', default='', metavar='WORDS', help='only kinds with one of these words, by comma'
    )
    add('--times', type=int, default=2, metavar='N', help='random moments of each kind')
    add(
        '--stops',
        type=int,
        default=4,
        metavar='N',
        help='controllers and localizers killed or stopped at full speed',
    )
    add('--speed', type=float, default=1.0, metavar='F', help='times real time')
    add('--jobs', type=int, default=1, metavar='N', help='stacks at a time')
    add('--results', type=Path, metavar='DIR', help='keep verdicts there, and go on from them')
    add('--out', type=Path, metavar='FILE', help='write the table, in Markdown')
    add('--note', default='', metavar='TEXT', help='a sentence about the machine, for the table')
    add('--as-it-is', action='store_true', help='write the table from what is there')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Inject what is not there yet, and judge.

    Raises:
        GoalreachError: An option is refused, a file cannot be written, or no stack comes up.
    """
    from goalreach_lab.faults.document import fault_document, summarise_kinds
    from goalreach_lab.faults.kinds import choose_kinds
    from goalreach_lab.faults.results_file import read_verdicts
    from goalreach_msgs_py.errors import ConfigurationError
    from goalreach_msgs_py.files import require_writable, write_text_atomically

    for name, least in (('times', 0), ('stops', 0), ('jobs', 1), ('speed', 0.1)):
        if not getattr(options, name) >= least:
            raise ConfigurationError(f'--{name}', getattr(options, name), f'at least {least}')
    kinds = choose_kinds(options.kinds)
    if options.out is not None:
        require_writable(options.out)
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        results = options.results or Path(folder)
        if not options.as_it_is:
            _inject(options, kinds, results)
        stops = _stop(options, results)
        chosen = {kind.name for kind in kinds}
        verdicts = [v for v in read_verdicts(results) if v.kind in chosen]
    summaries = summarise_kinds(verdicts)
    if options.out is not None:
        command = f'goalreach bench --seed {options.seed} faults --times {options.times}'
        write_text_atomically(options.out, fault_document(summaries, command, options.note))
    rows = [*(_kind_row(one) for one in summaries)]
    rows += _total_rows(verdicts, summaries) if verdicts else []
    return [*rows, *_stop_rows(stops)]


def _inject(options: argparse.Namespace, kinds: Sequence[FaultKind], results: Path) -> None:
    from goalreach_lab.faults.document import tells_of_recovery
    from goalreach_lab.faults.results_file import read_verdicts
    from goalreach_lab.rigs.stack import free_domains

    verdicts = read_verdicts(results)
    done = [verdict.kind for verdict in verdicts if tells_of_recovery(verdict)]
    rng = np.random.default_rng([options.seed, len(verdicts)])
    order: list[FaultKind] = []
    for number in range(options.times):  # round by round, so that no node dies too often in a row
        missing = [kind for kind in kinds if options.times - done.count(kind.name) > number]
        order += [missing[i] for i in rng.permutation(len(missing))]
    parts = [order[job :: options.jobs] for job in range(options.jobs)]
    work = partial(_work, results=results, speed=options.speed)
    seeds = [int(word) for word in rng.integers(2**31, size=options.jobs)]
    domains = free_domains(options.jobs)
    if options.jobs == 1:
        work(parts[0], domains[0], seeds[0])
        return
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(max_workers=options.jobs, mp_context=context) as pool:
        list(pool.map(work, parts, domains, seeds))


def _work(
    kinds: Sequence[FaultKind], domain: int, seed: int, *, results: Path, speed: float
) -> None:
    from goalreach_lab.faults.results_file import VerdictFile
    from goalreach_lab.faults.ros_campaign import inject_faults

    file = VerdictFile(results / f'faults-{domain}.jsonl')
    if kinds:
        inject_faults(kinds, domain=domain, speed=speed, seed=seed, keep=file.add)


def _stop(options: argparse.Namespace, results: Path) -> list[float]:
    """Return the time to stand after each dead part, measuring those not there yet."""
    from goalreach_evaluation.summary_file import append_line, read_lines
    from goalreach_lab.faults.ros_stops import measure_stops
    from goalreach_lab.rigs.stack import free_domains

    path = results / 'stops.jsonl'
    done = len(read_lines(path))
    if done < options.stops and not options.as_it_is:
        measure_stops(
            options.stops - done,
            domain=free_domains(1)[0],
            speed=options.speed,
            seed=options.seed + done,
            keep=lambda part, taken_s: append_line(path, {'part': part, 'taken_s': taken_s}),
        )
    return [float(line['taken_s']) for line in read_lines(path)]


def _stop_rows(taken_s: Sequence[float]) -> list[BenchRow]:
    if not taken_s:
        return []
    late = sum(one > _STOP_S for one in taken_s)
    return [
        BenchRow(
            name='dead controller or localizer: robot not at rest within 0.6 s',
            unit='',
            ours=late,
            goal=Goal(of='ours', relation='<=', bound=0.0),
            n=len(taken_s),
            note=f'median {np.median(taken_s):.2f} s, longest {max(taken_s):.2f} s',
        )
    ]


def _kind_row(one: KindSummary) -> BenchRow:
    bad = one.bumps + one.wrong + one.hangs + (one.injected - one.named)
    note = (
        f'bumps {one.bumps}, wrong {one.wrong} (worst {one.worst_m:.3f} m), hangs {one.hangs}, '
        f'named {one.named} of {one.injected}, median {one.recovery_median_s:.2f} s'
    )
    limit = _RECOVERY_S if not bad else -1.0
    return BenchRow(
        name=one.kind.name,
        unit='s to recover, p95',
        ours=one.recovery_p95_s,
        goal=Goal(of='ours', relation='<=', bound=limit),
        n=one.injected,
        note=note,
    )


def _total_rows(verdicts: Sequence[Verdict], summaries: Sequence[KindSummary]) -> list[BenchRow]:
    from goalreach_lab.faults.document import recovery_times

    def row(name: str, ours: float) -> BenchRow:
        goal = Goal(of='ours', relation='<=', bound=0.0)
        return BenchRow(name=name, unit='', ours=ours, goal=goal, n=len(verdicts))

    times_s = recovery_times(verdicts)
    return [
        BenchRow(name='kinds of fault', unit='', ours=len(summaries), n=len(verdicts)),
        row('bumps', sum(v.bumps for v in verdicts)),
        row('faults with a wrong pose believed good', sum(v.wrong > 0 for v in verdicts)),
        row('hangs', sum(v.recovery_s is None for v in verdicts)),
        row('faults that nothing named', sum(not v.report for v in verdicts)),
        BenchRow(
            name='recovery of all, p95',
            unit='s',
            ours=float(np.percentile(times_s, 95)) if times_s else float('nan'),
            goal=Goal(of='ours', relation='<=', bound=_RECOVERY_S),
            n=len(times_s),
        ),
    ]
