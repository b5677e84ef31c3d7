"""Hours of driving with random faults, and what every process holds meanwhile."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
from functools import partial
from pathlib import Path
import tempfile
from typing import Final

import numpy as np

from goalreach_bringup.launch.environment import present_files
from goalreach_lab.faults.growth import Sample
from goalreach_lab.faults.kinds import KINDS, FaultKind
from goalreach_lab.faults.ros_injector import Injector
from goalreach_lab.rigs.processes import descendants_of, holdings_of
from goalreach_lab.rigs.ros_bench_graph import BenchGraph
from goalreach_msgs_py.errors import GoalreachError

_LASTING: Final = ('parameter', 'dark', 'light', 'bumper', 'carry', 'place', 'stop')
_SAMPLE_S: Final = 2.0
_PAUSE_S: Final = (5.0, 15.0)
_KILL_SHARE: Final = 0.3
_STALLED_S: Final = 60.0


def drive_for_hours(
    hours: float,
    *,
    domain: int,
    seed: int,
    lockstep: bool,
    keep: Callable[[Sample], None],
    tell: Callable[[float, str], None],
) -> None:
    """Drive, break things, and take samples.

    Nodes are killed only in the first fifth, so that those there at the end have a past to be
    compared with; all else goes on to the end.

    Args:
        hours: Simulated hours.
        domain: ROS domain.
        seed: Of the faults.
        lockstep: As fast as the machine can, or in real time.
        keep: Called with each sample.
        tell: Called with the simulated seconds and the name of each fault.

    Raises:
        GoalreachError: The stack does not come up, or does not go on.
    """
    rng = np.random.default_rng(seed)
    total_s = 3600.0 * hours
    lasting = [kind for kind in KINDS if kind.act in _LASTING]
    killing = [kind for kind in KINDS if kind.act == 'kill']
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        graph = BenchGraph(
            domain=domain, speed=1.0, seed=seed, log_directory=Path(folder), gates=False
        )
        try:
            injector = Injector(graph, rng)
            graph.start('--clock', 'lockstep' if lockstep else 'realtime', '--starts', 'random')
            while graph.record.clock_s < total_s:
                _sample_for(graph, rng.uniform(*_PAUSE_S), keep)
                early = graph.record.clock_s < total_s / 5.0
                kinds = killing if early and rng.random() < _KILL_SHARE else lasting
                kind = kinds[int(rng.integers(len(kinds)))]
                tell(graph.record.clock_s, kind.name)
                _break(injector, kind)
        finally:
            graph.close()


def _break(injector: Injector, kind: FaultKind) -> None:
    with contextlib.suppress(GoalreachError, ProcessLookupError):
        injector.inject(kind)


def _has_ticked(graph: BenchGraph, before_ns: int) -> bool:
    return graph.record.clock_ns != before_ns


def _sample_for(graph: BenchGraph, seconds: float, keep: Callable[[Sample], None]) -> None:
    """Take samples for a time of the wall clock."""
    record = graph.record
    for _ in range(max(1, round(seconds / _SAMPLE_S))):
        before_ns = record.clock_ns
        graph.serve(_SAMPLE_S)
        if not graph.serve_until(partial(_has_ticked, graph, before_ns), _STALLED_S):
            raise GoalreachError('the stack does not go on: ' + '; '.join(list(record.lines)[-5:]))
        launcher, files = graph.running.pid, len(present_files())
        for pid in (launcher, *descendants_of(launcher)):
            holdings = holdings_of(pid)
            if holdings is not None:
                sample = Sample(
                    pid=pid,
                    clock_s=record.clock_s,
                    holdings=holdings,
                    present_files=files,
                )
                keep(sample)
