"""Whether what processes hold grows over hours, from samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import statistics

from goalreach_bringup.faults.proc_file import Holdings

__all__ = ['Growth', 'Sample', 'growths']


@dataclass(frozen=True, kw_only=True)
class Sample:
    """What one process held at one moment.

    Attributes:
        pid: Process id.
        clock_s: Simulated time.
        holdings: What it held.
    """

    pid: int
    clock_s: float
    holdings: Holdings


@dataclass(frozen=True, kw_only=True)
class Growth:
    """What one process gained from the settled beginning to the end.

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
    """Return the growth of every process that lived from the settled beginning to the end.

    The beginning and the end are medians over a tenth of the samples in between, so that one
    moment of much work decides nothing.

    Args:
        samples: In the order taken.
        settled_s: Simulated time from which on memory is compared.
    """
    found = []
    last_s = max((sample.clock_s for sample in samples), default=0.0)
    # A spare process that became a node has begun anew: it is told apart by its name.
    for life in dict.fromkeys((sample.pid, sample.holdings.name) for sample in samples):
        settled = [s for s in samples if s.clock_s >= settled_s]
        own = [s for s in settled if (s.pid, s.holdings.name) == life]
        is_there = own and own[-1].clock_s >= 0.95 * last_s
        if is_there and own[0].clock_s <= settled_s + 0.1 * (last_s - settled_s):
            found.append(_growth(own))
    return sorted(found, key=lambda growth: growth.name)


def _growth(own: Sequence[Sample]) -> Growth:
    part = max(1, len(own) // 10)
    before, after = own[:part], own[-part:]

    def gained(name: str) -> float:
        values = [[float(getattr(s.holdings, name)) for s in some] for some in (before, after)]
        return statistics.median(values[1]) - statistics.median(values[0])

    memory_mb = statistics.median(s.holdings.memory_mb for s in before)
    return Growth(
        name=own[-1].holdings.name,
        samples=len(own),
        span_s=own[-1].clock_s - own[0].clock_s,
        memory_share=gained('memory_mb') / memory_mb,
        memory_mb=own[-1].holdings.memory_mb,
        handles=gained('handles'),
        threads=gained('threads'),
        shared_files=gained('shared_files'),
    )
