"""Hours of simulated driving with random faults: what each process holds must not grow."""

from collections.abc import Sequence
import contextlib
from dataclasses import dataclass
from functools import partial
import statistics
import sys
from typing import Final

from goalreach_lab.options import BenchOptions
from goalreach_lab.rigs.processes import Sample
from goalreach_lab.rigs.stack import free_domains
from goalreach_lab.row import BenchRow, Goal
from goalreach_msgs_py.noise import NOISE_PRESETS
from goalreach_msgs_py.options import option

SUMMARY = 'Drive for hours with random faults; memory, handles and shared memory must stay flat'

_SETTLED_S: Final = 900.0
_GROWTH: Final = 0.02


@dataclass(frozen=True, kw_only=True)
class Options(BenchOptions):
    """Options of the suite."""

    hours: float = option(2.0, 'simulated hours', above=0.0, maximum=1000.0)
    clock: str = option('lockstep', 'how time passes', choices=('lockstep', 'realtime'))
    noise: str = option('nominal', 'sensor errors', choices=NOISE_PRESETS)


@dataclass(frozen=True, kw_only=True)
class Growth:
    """What one process gained from its settled beginning to its end.

    Attributes:
        name: The process.
        samples: Samples behind it.
        span_s: Simulated time between beginning and end.
        memory_share: Memory gained over memory held.
        memory_mb: Memory held at the end.
        handles: Files, sockets and pipes gained.
        threads: Threads gained.
        shared_files: Files in shared memory gained.
    """

    name: str
    samples: int
    span_s: float
    memory_share: float
    memory_mb: float
    handles: float
    threads: float
    shared_files: float


def execute(options: Options) -> list[BenchRow]:
    """Drive, inject faults, and compare the holdings of each process; Ctrl-C ends it and reports.

    Raises:
        GoalreachError: The stack does not come up, or stalls.
    """
    from goalreach_lab.faults.ros_soak import drive_for_hours

    samples: list[Sample] = []
    faults: list[str] = []

    def on_fault(clock_s: float, name: str) -> None:
        faults.append(name)
        sys.stderr.write(f'{clock_s:8.1f} s  {name}\n')

    with contextlib.suppress(KeyboardInterrupt):  # the samples so far are worth their rows
        drive_for_hours(
            options.hours,
            domain=free_domains(1)[0],
            seed=options.seed,
            words=('--clock', options.clock, '--noise', options.noise),
            keep=samples.append,
            on_fault=on_fault,
        )
    driven_h = max((sample.clock_s for sample in samples), default=0.0) / 3600.0
    settled_s = min(_SETTLED_S, 0.25 * 3600.0 * options.hours)
    rows = [row for one in growths(samples, settled_s) for row in _rows(one)]
    return [
        BenchRow(name='faults', unit='', ours=len(faults), note=f'in {driven_h:.2f} h simulated'),
        *rows,
        BenchRow.none_allowed(
            'files in shared memory, gained', files_gained(samples, settled_s), n=len(samples)
        ),
    ]


def _rows(one: Growth) -> Sequence[BenchRow]:
    flat = partial(BenchRow.none_allowed, n=one.samples)
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
        flat(f'{one.name}, handles gained', one.handles),
        flat(f'{one.name}, threads gained', one.threads),
        flat(f'{one.name}, shared-memory files gained', one.shared_files),
    ]


def growths(samples: Sequence[Sample], settled_s: float) -> list[Growth]:
    """Return the growth of every process, over its longest life where it was restarted.

    Beginning and end are medians over a tenth of the samples in between, so that one moment of
    much work does not matter. A life that did not last for as long after it had settled is too
    short to compare.

    Args:
        samples: In the order taken.
        settled_s: Simulated time after which a process has settled.
    """
    longest: dict[str, list[Sample]] = {}
    # A process that was forked before it became a node begins anew when it takes its name.
    for pid, name in dict.fromkeys((sample.pid, sample.holdings.name) for sample in samples):
        own = [one for one in samples if (one.pid, one.holdings.name) == (pid, name)]
        settled = _settled(own, settled_s)
        if len(settled) > len(longest.get(name, ())) and _span_s(settled) >= settled_s:
            longest[name] = settled
    return [_growth(longest[name]) for name in sorted(longest)]


def files_gained(samples: Sequence[Sample], settled_s: float) -> float:
    """Return the number of files of Fast DDS gained from the settled beginning to the end.

    Args:
        samples: In the order taken.
        settled_s: As in `growths`.
    """
    before, after = _ends(_settled(samples, settled_s))
    return _gained([s.present_files for s in before], [s.present_files for s in after])


def _settled(samples: Sequence[Sample], settled_s: float) -> list[Sample]:
    return [one for one in samples if one.clock_s >= samples[0].clock_s + settled_s]


def _span_s(samples: Sequence[Sample]) -> float:
    return samples[-1].clock_s - samples[0].clock_s if samples else 0.0


def _ends(samples: Sequence[Sample]) -> tuple[Sequence[Sample], Sequence[Sample]]:
    part = max(1, len(samples) // 10)
    return samples[:part], samples[-part:]


def _gained(before: Sequence[float], after: Sequence[float]) -> float:
    return statistics.median(after) - statistics.median(before) if before and after else 0.0


def _growth(own: Sequence[Sample]) -> Growth:
    before, after = _ends(own)

    def gained(name: str) -> float:
        values = [[float(getattr(s.holdings, name)) for s in some] for some in (before, after)]
        return _gained(*values)

    memory_mb = statistics.median(s.holdings.memory_mb for s in before)
    return Growth(
        name=own[-1].holdings.name, samples=len(own), span_s=_span_s(own),
        memory_share=gained('memory_mb') / memory_mb, memory_mb=own[-1].holdings.memory_mb,
        handles=gained('handles'), threads=gained('threads'), shared_files=gained('shared_files'),
    )  # fmt: skip
