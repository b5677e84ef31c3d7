"""One fault after the other at random moments of one live stack."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import math
from pathlib import Path
import sys
import tempfile
import time
from typing import Final

import numpy as np

from goalreach_bringup.launch.ros.supervisor import Backoff
from goalreach_lab.faults.judge import Verdict
from goalreach_lab.faults.kinds import FaultKind
from goalreach_lab.faults.ros_injector import Injector
from goalreach_lab.rigs.ros_bench_graph import BenchGraph
from goalreach_msgs_py.errors import GoalreachError

_MOMENT_S: Final = (0.0, 1.5)
_DRIVING_S: Final = 40.0
_RECOVER_S: Final = 25.0
_SETTLED_S: Final = 0.5
_LOOK_S: Final = 0.3
_FAST_M_PER_S: Final = 0.1
_FAR_M: Final = 3.2
"""A fault begins farther than this from the goal wall, 1.5 m before the goal region, so that few
paths end within one. Chosen."""
_MIDDLE_M: Final = 2.3
"""Nearer than this the robot drives on to the goal; between, it is put back. Chosen."""

_BACK: Final = ((0.6, 2.9), (4.0, 4.6), (-2.0, -1.1))
"""Where it is put back to, facing the goal wall: ranges of x, y (m) and heading (rad). Chosen."""

_STARTS: Final = ('0.6,4.5,-90', '2.9,4.6,-100', '1.2,4.7,-70', '2.4,4.4,-80', '1.8,4.7,-110')
"""Far from the goal and towards the LEDs, so that what is measured is no usual search."""


def inject_faults(
    kinds: Sequence[FaultKind],
    *,
    domain: int,
    speed: float,
    seed: int,
    keep: Callable[[Verdict], None],
) -> None:
    """Inject faults into one stack; it is started anew only after one that it did not survive.

    Args:
        kinds: What to inject, in this order.
        domain: ROS domain of the stack.
        speed: Seconds of the graph's clock in one of the wall's.
        seed: Of the moments and places.
        keep: Called with each verdict.

    Raises:
        GoalreachError: A sound stack does not drive.
    """
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        graph = BenchGraph(domain=domain, speed=speed, seed=seed, log_directory=Path(folder))
        injector = Injector(graph, rng)
        killed_s: dict[str, float] = {}
        try:
            for kind in kinds:
                if graph.stack is None:
                    graph.start(*(word for start in _STARTS for word in ('--start', start)))
                if kind.act == 'kill':
                    _let_be_forgiven(graph, killed_s.get(kind.target, -math.inf))
                    killed_s[kind.target] = time.monotonic()
                verdict = _one(graph, injector, kind, rng)
                if verdict is not None:
                    keep(verdict)
        finally:
            graph.close()


def _let_be_forgiven(graph: BenchGraph, death_s: float) -> None:
    """Drive on until a death is no longer counted, by which the next restart would be delayed."""
    left_s = death_s + Backoff().window_s - time.monotonic()
    if left_s > 0.0:
        graph.serve(left_s)


def _one(
    graph: BenchGraph, injector: Injector, kind: FaultKind, rng: np.random.Generator
) -> Verdict | None:
    """Return what came of a fault, or None where it could not be injected."""
    record = graph.record
    if not _drive_far_off(graph, injector, rng):
        said = '; '.join(list(record.lines)[-3:])
        sys.stderr.write(f'before {kind.name}: the robot did not drive: {said}\n')
        graph.stop()
        return None
    record.begin()
    began_ns = record.clock_ns
    try:
        injector.inject(kind)
    except (GoalreachError, ProcessLookupError) as error:
        sys.stderr.write(f'{kind.name}: could not be injected: {error}\n')
        graph.stop()
        return None
    ended = (record.clock_ns, time.monotonic())
    record.end()
    graph.serve_until(lambda: record.healthy_since is not None, _RECOVER_S)
    sound = record.healthy_since
    graph.serve(_SETTLED_S / graph.speed)
    verdict = record.verdict(
        kind.name,
        kind.named,
        began_ns=began_ns,
        ended=ended,
        sound=sound,
        speed=graph.speed,
    )
    if sound is None or graph.stack is None or not graph.stack.alive:
        graph.stop()
    return verdict


def _drive_far_off(graph: BenchGraph, injector: Injector, rng: np.random.Generator) -> bool:
    """Let the robot drive, at a random moment, far from the goal; return whether it does."""
    record = graph.record

    def drives() -> bool:
        return record.healthy_since is not None and record.speed_m_per_s > _FAST_M_PER_S

    deadline_s = time.monotonic() + _DRIVING_S
    while time.monotonic() < deadline_s:
        if _MIDDLE_M < record.y_m <= _FAR_M and drives():
            injector.put([float(rng.uniform(*limits)) for limits in _BACK])
            record.end()
        if not graph.serve_until(lambda: drives() and record.y_m > _FAR_M, _LOOK_S):
            continue
        graph.serve(rng.uniform(*_MOMENT_S) / graph.speed)
        if drives() and record.y_m > _FAR_M:
            return True
    return False
