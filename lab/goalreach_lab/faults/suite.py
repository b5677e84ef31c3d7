"""Faults injected into live stacks: bumps, overconfident poses, hangs, recovery, reports."""

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
import math
import multiprocessing
from pathlib import Path
import tempfile
import textwrap
from typing import Any, Final

import numpy as np

from goalreach_lab.faults.kinds import FaultKind, choose_kinds
from goalreach_lab.faults.outcome import (
    FaultOutcome,
    KindSummary,
    outcome_table,
    recovery_times_s,
    summarise_kinds,
)
from goalreach_lab.options import DocumentOptions
from goalreach_lab.rigs.stack import free_domains
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study import Study, run_study
from goalreach_lab.study_file import StudyFile
from goalreach_lab.template import write_document
from goalreach_msgs_py.files import require_writable
from goalreach_msgs_py.options import option

SUMMARY = 'Inject faults into a live stack: the behaviour of each, and the time to recover'

_RECOVERY_S: Final = 3.0
_RESTART_S: Final = 2.5
"""Goals of the 95th percentile: of any fault, and of a killed node."""

_STOP_S: Final = 0.6
"""Goal by the graph's clock: the watchdog, 0.5 s, and two ticks."""

_PASSES: Final = 3
"""How often what is missing is injected: faults in which a path ended count as missing. Chosen."""

_WIDTH: Final = 99
_Numbered = tuple[int, FaultKind]
_TEMPLATE: Final = Path(__file__).with_name('faults.md')


@dataclass(frozen=True, kw_only=True)
class Options(DocumentOptions):
    """Options of the suite."""

    kinds: str = option('', 'only kinds with one of these words, by comma', metavar='WORDS')
    times: int = option(2, 'random moments of each kind', minimum=0)
    stops: int = option(4, 'controllers and localizers ended at full speed', minimum=0)
    speed: float = option(1.0, 'times real time', minimum=0.1)
    note: str = option('', 'a sentence about the machine, for the document')


def execute(options: Options) -> list[BenchRow]:
    """Inject the faults that are missing, and report all outcomes.

    Raises:
        GoalreachError: An option is refused, a file cannot be written, or no stack comes up.
    """
    kinds = choose_kinds(options.kinds)
    if options.out is not None:
        require_writable(options.out)
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        results = options.results or Path(folder)
        _outcomes_file(results, options.speed, options.seed).tell_others()
        for _ in () if options.as_it_is else range(_PASSES):
            _inject_missing(options, kinds, results)
        stops = _measure_stops(options, results)
        chosen = {kind.name for kind in kinds}
        outcomes = [one for one in read_outcomes(results, options.speed) if one.kind in chosen]
    summaries = summarise_kinds(outcomes)
    if options.out is not None:
        command = f'python3 scripts/bench.py faults --seed {options.seed} --times {options.times}'
        note = textwrap.fill(options.note, _WIDTH)
        values = {'command': command, 'note': note, 'table': outcome_table(summaries)}
        write_document(options.out, _TEMPLATE, values)
    rows = [*(_kind_row(one) for one in summaries)]
    rows += _total_rows(outcomes, summaries) if outcomes else []
    asked, short = len(kinds) * options.times, len(_missing(options, kinds, outcomes))
    rows.append(BenchRow.none_allowed('faults asked for that were not injected', short, n=asked))
    return [*rows, *_stop_rows(stops)]


def _outcomes_file(results: Path, speed: float, seed: int | None = None) -> StudyFile:
    path, settings = results / 'faults.jsonl', {'speed': speed}
    return StudyFile(path, key=('kind', 'number'), settings=settings, seed=seed)


def read_outcomes(results: Path, speed: float) -> list[FaultOutcome]:
    """Return the outcomes that are kept in a folder.

    Args:
        results: The folder.
        speed: Seconds of the graph's clock in one of the wall clock, of all of them.

    Raises:
        FileFormatError: The file holds outcomes of another speed or cannot be read.
    """
    kept = _outcomes_file(results, speed).results
    return [FaultOutcome(**{k: v for k, v in one.items() if k != 'number'}) for one in kept]


def _missing(
    options: Options, kinds: Sequence[FaultKind], outcomes: Sequence[FaultOutcome]
) -> list[_Numbered]:
    """Return the faults that are still to inject, each with its round."""
    done = Counter(one.kind for one in outcomes if one.measures_recovery)
    return [(n, kind) for kind in kinds for n in range(options.times - done[kind.name])]


def plan(options: Options, kinds: Sequence[FaultKind], results: Path) -> list[_Numbered]:
    """Return the faults that are missing in a folder, each with a number that none there has."""
    kept = _outcomes_file(results, options.speed).results
    first = 1 + max((int(one['number']) for one in kept), default=-1)
    missing = _missing(options, kinds, read_outcomes(results, options.speed))
    order = np.random.default_rng([options.seed, first]).permutation(len(missing))
    # Round by round, so that no node dies often in a row.
    rounds = sorted((missing[i] for i in order), key=lambda one: (one[0], one[1].words))
    return list(enumerate((kind for _, kind in rounds), start=first))


def _inject_missing(options: Options, kinds: Sequence[FaultKind], results: Path) -> None:
    numbered = plan(options, kinds, results)
    if not numbered:
        return
    parts = [numbered[job :: options.jobs] for job in range(options.jobs)]
    work = partial(_inject_part, results=results, options=options)
    rng = np.random.default_rng([options.seed, numbered[0][0], 1])
    seeds = rng.integers(2**31, size=options.jobs).tolist()
    domains = free_domains(options.jobs)
    if options.jobs == 1:
        work(parts[0], domains[0], seeds[0])
        return
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(max_workers=options.jobs, mp_context=context) as pool:
        list(pool.map(work, parts, domains, seeds))


def _inject_part(
    numbered: Sequence[_Numbered], domain: int, seed: int, *, results: Path, options: Options
) -> None:
    """Inject faults into a stack of this process, and keep each outcome."""
    from goalreach_lab.faults.ros_campaign import inject_faults

    file = _outcomes_file(results, options.speed, options.seed)
    kinds = [kind for _, kind in numbered]
    if kinds:
        outcomes = inject_faults(kinds, domain=domain, speed=options.speed, seed=seed)
        for outcome, (number, _) in zip(outcomes, numbered, strict=False):
            file.add({'kind': outcome.kind, 'number': number}, outcome.to_json())


def _measure_stops(options: Options, results: Path) -> list[dict[str, Any]]:
    """Return the kept and the missing times to rest after the end of a node."""
    from goalreach_lab.faults.ros_campaign import measure_stops

    measure = partial(measure_stops, speed=options.speed, seed=options.seed)
    study = Study(
        name='stops',
        key=('number',),
        cases=[{'number': number} for number in range(options.stops)],
        measure=lambda cases: measure(cases, domain=free_domains(1)[0]),
        settings={'speed': options.speed},
        seed=options.seed,
    )
    return run_study(study, results, measure=not options.as_it_is)


def _stop_rows(stops: Sequence[dict[str, Any]]) -> list[BenchRow]:
    if not stops:
        return []
    taken_s = [math.inf if one['taken_s'] is None else float(one['taken_s']) for one in stops]
    return [
        BenchRow.none_allowed(
            'controller or localizer ended: robot not at rest within 0.6 s',
            sum(one > _STOP_S for one in taken_s),
            n=len(taken_s),
            note=f'median {np.median(taken_s):.2f} s, longest {max(taken_s):.2f} s',
        )
    ]


def _kind_row(one: KindSummary) -> BenchRow:
    note = (
        f'bumps {one.bumps}, overconfident {one.overconfident} (worst {one.worst_m:.3f} m), '
        f'hangs {one.hangs}, reported {one.reported} of {one.injected}, '
        f'median {one.recovery_median_s:.2f} s'
    )
    limit_s = _RESTART_S if one.kind.act == 'kill' else _RECOVERY_S
    return BenchRow(
        name=one.kind.name,
        unit='s to recover, p95',
        ours=one.recovery_p95_s,
        goal=Goal(of='ours', relation='<=', bound=limit_s),
        n=one.injected,
        note=note,
    )


def _total_rows(
    outcomes: Sequence[FaultOutcome], summaries: Sequence[KindSummary]
) -> list[BenchRow]:
    row = partial(BenchRow.none_allowed, n=len(outcomes))
    times_s = recovery_times_s(outcomes)
    return [
        BenchRow(name='kinds of fault', unit='', ours=len(summaries), n=len(outcomes)),
        row('bumps', sum(one.bumps for one in outcomes)),
        row('faults with an overconfident pose', sum(o.overconfident > 0 for o in outcomes)),
        row('hangs', sum(one.recovery_s is None for one in outcomes)),
        row('faults without a report', sum(not one.report for one in outcomes)),
        BenchRow(
            name='recovery from all, p95',
            unit='s',
            ours=float(np.percentile(times_s, 95)) if times_s else math.nan,
            goal=Goal(of='ours', relation='<=', bound=_RECOVERY_S),
            n=len(times_s),
        ),
    ]
