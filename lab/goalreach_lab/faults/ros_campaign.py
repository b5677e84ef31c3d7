"""Campaigns on one live stack: faults at random moments, and dead nodes at full speed."""

from collections.abc import Iterator, Sequence
import contextlib
import math
import os
from pathlib import Path
import shlex
import signal
import sys
import tempfile
import time
from typing import Any, Final

import numpy as np

from goalreach_bringup.launch.graph import Backoff
from goalreach_lab.faults.kinds import FaultKind
from goalreach_lab.faults.outcome import FaultOutcome
from goalreach_lab.faults.ros_faulted_graph import FaultedGraph
from goalreach_lab.faults.ros_injector import Injector
from goalreach_lab.study import Case, Result
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.topics import CONTROLLER, LOCALIZER

_MOMENT_S: Final = (0.0, 1.5)
_DRIVING_S: Final = 40.0
_RECOVER_S: Final = 25.0
_SETTLED_S: Final = 0.5
_POLL_S: Final = 0.3
_FAST_M_PER_S: Final = 0.1
_FAR_M: Final = 3.2
"""A fault begins farther than this from the goal wall, 1.5 m before the goal region, so that few
paths end within one. Chosen."""
_MIDDLE_M: Final = 2.3
"""Nearer than this the robot drives on to the goal; between the two, it is put back. Chosen."""

_BACK: Final = ((0.6, 2.9), (4.0, 4.6), (-2.0, -1.1))
"""It is put back here, facing the goal wall: ranges of x, y (m) and heading (rad). Chosen."""

_STARTS: Final = ('0.6,4.5,-90', '2.9,4.6,-100', '1.2,4.7,-70', '2.4,4.4,-80', '1.8,4.7,-110')
"""Far from the goal and facing the LEDs, so that no path begins with a search."""

_NODES: Final = (CONTROLLER, LOCALIZER)
_SIGNALS: Final = (signal.SIGKILL, signal.SIGSTOP)
_FULL_SPEED_M_PER_S: Final = 0.5
_AT_REST_M_PER_S: Final = 1e-6
_FAST_STARTS: Final = ('1.8,4.7,-90', '1.2,4.7,-80', '2.4,4.7,-100')
_PER_STACK: Final = 8
"""A node is killed at most twice in one stack, far from the number that makes the run fail."""


@contextlib.contextmanager
def _faulted_graph(domain: int, speed: float, seed: int, *, gates: bool) -> Iterator[FaultedGraph]:
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        graph = FaultedGraph(
            domain=domain, speed=speed, seed=seed, log_directory=Path(folder), gates=gates
        )
        try:
            yield graph
        finally:
            graph.close()


def _start_words(starts: Sequence[str]) -> list[str]:
    return [word for start in starts for word in ('--start', start)]


def inject_faults(
    kinds: Sequence[FaultKind], *, domain: int, speed: float, seed: int
) -> Iterator[FaultOutcome]:
    """Inject faults into one stack, which is restarted only after one that it did not survive.

    Args:
        kinds: Faults to inject, in this order.
        domain: ROS domain of the stack.
        speed: Seconds of the graph's clock in one of the wall clock.
        seed: Seed of the moments and places.

    Yields:
        The outcome of each fault that could be injected.

    Raises:
        GoalreachError: The stack does not drive without a fault.
    """
    rng = np.random.default_rng(seed)
    killed_s: dict[str, float] = {}
    words = ''
    with _faulted_graph(domain, speed, seed, gates=True) as graph:
        injector = Injector(graph, rng)
        for kind in kinds:
            if kind.words != words:
                graph.stop()
            if graph.stack is None:
                graph.start(*_start_words(_STARTS), *shlex.split(kind.words))
            words = kind.words
            if kind.act == 'kill':
                _wait_for_backoff(graph, killed_s.get(kind.target, -math.inf))
                killed_s[kind.target] = time.monotonic()
            outcome = _inject(graph, injector, kind, rng)
            if outcome is not None:
                yield outcome


def _wait_for_backoff(graph: FaultedGraph, death_s: float) -> None:
    """Drive on until an earlier death of the node no longer delays its next restart."""
    left_s = death_s + Backoff().window_s - time.monotonic()
    if left_s > 0.0:
        graph.serve(left_s)


def _inject(
    graph: FaultedGraph, injector: Injector, kind: FaultKind, rng: np.random.Generator
) -> FaultOutcome | None:
    """Return the outcome of a fault, or None where it could not be injected."""
    observer = graph.observer
    if not _drive_far_from_goal(graph, injector, rng):
        lines = '; '.join(list(observer.lines)[-3:])
        sys.stderr.write(f'before {kind.name}: the robot did not drive: {lines}\n')
        graph.stop()
        return None
    observer.reset_counts()
    began_ns = observer.clock_ns
    try:
        injector.inject(kind)
    except (GoalreachError, ProcessLookupError) as error:
        sys.stderr.write(f'{kind.name}: could not be injected, or ended: {error}\n')
        graph.stop()
        if not injector.begun:
            return None
    ended = (observer.clock_ns, time.monotonic())
    observer.await_normal()
    if graph.stack is not None:  # one that does not even let the fault be ended hangs
        graph.serve_until(lambda: observer.normal_since is not None, _RECOVER_S)
    normal = observer.normal_since
    graph.serve(_SETTLED_S / graph.speed)
    outcome = FaultOutcome.observed(
        kind, observer, began_ns=began_ns, ended=ended, normal=normal, speed=graph.speed
    )
    if normal is None or graph.stack is None or not graph.stack.alive:
        graph.stop()
    return outcome


def _drive_far_from_goal(
    graph: FaultedGraph, injector: Injector, rng: np.random.Generator
) -> bool:
    """Wait for a random moment of driving, far from the goal; return whether it came."""
    observer = graph.observer

    def drives() -> bool:
        return observer.normal_since is not None and observer.speed_m_per_s > _FAST_M_PER_S

    deadline_s = time.monotonic() + _DRIVING_S
    while time.monotonic() < deadline_s:
        if _MIDDLE_M < observer.y_m <= _FAR_M and drives():
            injector.put([float(rng.uniform(*limits)) for limits in _BACK])
            observer.await_normal()
        if not graph.serve_until(lambda: drives() and observer.y_m > _FAR_M, _POLL_S):
            continue
        graph.serve(rng.uniform(*_MOMENT_S) / graph.speed)
        if drives() and observer.y_m > _FAR_M:
            return True
    return False


def measure_stops(
    cases: Sequence[Case], *, domain: int, speed: float, seed: int
) -> Iterator[tuple[Case, Result]]:
    """Kill or stop controller or localizer at full speed, and time how the robot comes to rest.

    The launcher is stopped meanwhile: it would replace the node before the robot is at rest.

    Args:
        cases: Their `number` decides which node gets which signal.
        domain: ROS domain of the stack.
        speed: Seconds of the graph's clock in one of the wall clock.
        seed: Seed of the moments.

    Yields:
        Each case with the node, the signal and the seconds of the graph's clock until the robot
        was at rest, `taken_s`, which is None where it did not come to rest.

    Raises:
        GoalreachError: The stack does not drive.
    """
    rng = np.random.default_rng([seed, *(case['number'] for case in cases[:1])])
    with _faulted_graph(domain, speed, seed, gates=False) as graph:
        for count, case in enumerate(cases):
            if count % _PER_STACK == 0:
                graph.stop()
            number = case['number']
            node, how = _NODES[number % 2], _SIGNALS[number // 2 % 2]
            result: dict[str, Any] | None = None
            while result is None:
                if graph.stack is None or not graph.stack.alive:
                    graph.stop()
                    graph.start(*_start_words(_FAST_STARTS))
                result = _measure_stop(graph, node, how, rng)
            yield case, result


def _measure_stop(
    graph: FaultedGraph, node: str, how: signal.Signals, rng: np.random.Generator
) -> dict[str, Any] | None:
    """Return the result of one stop, or None where the launcher is just replacing the node."""
    observer = graph.observer
    graph.serve(rng.uniform(0.0, 1.0) / graph.speed)
    fast = graph.serve_until(
        lambda: observer.normal_since is not None and observer.speed_m_per_s > _FULL_SPEED_M_PER_S,
        _DRIVING_S,
    )
    if not fast:
        raise GoalreachError('the robot does not reach full speed')
    graph.serve(rng.uniform(0.0, 0.04) / graph.speed)
    pid = graph.running.find_node(node)
    if pid is None:
        return None
    os.kill(graph.running.pid, signal.SIGSTOP)
    graph.running.send(node, how)
    moment_ns = time.time_ns()
    rests = graph.serve_until(lambda: observer.speed_m_per_s < _AT_REST_M_PER_S, _DRIVING_S)
    taken_s = (observer.clock_ns - observer.clock_at(moment_ns)) * 1e-9
    for stopped in (pid, graph.running.pid):
        with contextlib.suppress(ProcessLookupError):
            os.kill(stopped, signal.SIGCONT)
    observer.await_normal()
    graph.serve_until(lambda: observer.normal_since is not None, _DRIVING_S)
    return {
        'node': node, 'signal': how.name, 'taken_s': round(taken_s, 6) if rests else None
    }  # fmt: skip
