"""Whether what processes hold grows over hours, from samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import statistics

from goalreach_lab.rigs.processes import Holdings


@dataclass(frozen=True, kw_only=True)
class Sample:
    """What one process held at one moment.

    Attributes:
        pid: Process id.
        clock_s: Simulated time.
        holdings: What it held.
        present_files: Files of Fast DDS in shared memory then, whosever they were.
    """

    pid: int
    clock_s: float
    holdings: Holdings
    present_files: int = 0


@dataclass(frozen=True, kw_only=True)
class Growth:
    """What one process gained from its settled beginning to its end.

    Attributes:
        name: Which process.
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


def growths(samples: Sequence[Sample], settled_s: float) -> list[Growth]:
    """Return the growth of every process, of its longest life where it was killed or began anew.

    The beginning and the end are medians over a tenth of the samples in between, so that one
    moment of much work decides nothing. A life that did not go on for as long after it had settled
    is too short to tell.

    Args:
        samples: In the order taken.
        settled_s: Simulated time from a process's first sample on after which it is compared.
    """
    longest: dict[str, list[Sample]] = {}
    # A spare process that became a node has begun anew: it is told apart by its name.
    for pid, name in dict.fromkeys((sample.pid, sample.holdings.name) for sample in samples):
        own = [one for one in samples if (one.pid, one.holdings.name) == (pid, name)]
        settled = _settled(own, settled_s)
        if len(settled) > len(longest.get(name, ())) and _span_s(settled) >= settled_s:
            longest[name] = settled
    return [_growth(longest[name]) for name in sorted(longest)]


def files_gained(samples: Sequence[Sample], settled_s: float) -> float:
    """Return how many files of Fast DDS there were more at the end than at the settled beginning.

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
    if not (before and after):
        return 0.0
    return statistics.median(after) - statistics.median(before)


def _growth(own: Sequence[Sample]) -> Growth:
    before, after = _ends(own)

    def gained(name: str) -> float:
        values = [[float(getattr(s.holdings, name)) for s in some] for some in (before, after)]
        return _gained(*values)

    memory_mb = statistics.median(s.holdings.memory_mb for s in before)
    return Growth(
        name=own[-1].holdings.name,
        samples=len(own),
        span_s=_span_s(own),
        memory_share=gained('memory_mb') / memory_mb,
        memory_mb=own[-1].holdings.memory_mb,
        handles=gained('handles'),
        threads=gained('threads'),
        shared_files=gained('shared_files'),
    )
