"""Drives for hours with random faults, and samples the holdings of every process."""

from collections.abc import Callable, Sequence
import contextlib
from pathlib import Path
import tempfile
from typing import Final

import numpy as np

from goalreach_bringup.launch.environment import SHARED_MEMORY
from goalreach_lab.faults.kinds import KINDS, FaultKind
from goalreach_lab.faults.ros_faulted_graph import FaultedGraph
from goalreach_lab.faults.ros_injector import Injector
from goalreach_lab.rigs.processes import Sample, descendants_of, holdings_of
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
    words: Sequence[str],
    keep: Callable[[Sample], None],
    on_fault: Callable[[float, str], None],
) -> None:
    """Drive, inject faults, and take samples.

    Nodes are killed only in the first fifth, so that those that run at the end have a past to be
    compared with; other faults continue to the end.

    Args:
        hours: Simulated hours.
        domain: ROS domain.
        seed: Seed of the faults.
        words: Further arguments of `goalreach run`.
        keep: Called with each sample.
        on_fault: Called with the simulated seconds and the name of each fault that has ended.

    Raises:
        GoalreachError: The stack does not come up, or stalls.
    """
    rng = np.random.default_rng(seed)
    total_s = 3600.0 * hours
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        graph = FaultedGraph(
            domain=domain, speed=1.0, seed=seed, log_directory=Path(folder), gates=False
        )
        with contextlib.closing(graph):
            injector = Injector(graph, rng)
            graph.start(*words, '--starts', 'random')
            while graph.observer.clock_s < total_s:
                _sample_for(graph, rng.uniform(*_PAUSE_S), keep)
                kind = _draw_kind(rng, may_kill=graph.observer.clock_s < total_s / 5.0)
                with contextlib.suppress(GoalreachError, ProcessLookupError):
                    injector.inject(kind)
                    on_fault(graph.observer.clock_s, kind.name)


def _draw_kind(rng: np.random.Generator, *, may_kill: bool) -> FaultKind:
    kill = may_kill and rng.random() < _KILL_SHARE
    kinds = [k for k in KINDS if (k.act == 'kill' if kill else k.act in _LASTING)]
    return kinds[int(rng.integers(len(kinds)))]


def _sample_for(graph: FaultedGraph, seconds: float, keep: Callable[[Sample], None]) -> None:
    """Take samples for some seconds of the wall clock."""
    observer = graph.observer
    for _ in range(max(1, round(seconds / _SAMPLE_S))):
        before_ns = observer.clock_ns
        graph.serve(_SAMPLE_S)
        if not graph.serve_until(lambda: observer.clock_ns != before_ns, _STALLED_S):  # noqa: B023 - called here
            raise GoalreachError('the stack has stalled: ' + '; '.join(list(observer.lines)[-5:]))
        launcher, files = graph.running.pid, len([*SHARED_MEMORY.glob('*fastrtps_*')])
        for pid in (launcher, *descendants_of(launcher)):
            held = holdings_of(pid)
            if held is not None:
                keep(Sample(pid=pid, clock_s=observer.clock_s, holdings=held, present_files=files))
