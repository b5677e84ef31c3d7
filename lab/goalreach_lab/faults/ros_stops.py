"""How soon the robot stands when a part of what drives it is gone."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import os
from pathlib import Path
import signal
import tempfile
import time
from typing import Final

import numpy as np

from goalreach_lab.rigs.ros_bench_graph import BenchGraph
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.topics import CONTROLLER, LOCALIZER

_PARTS: Final = (CONTROLLER, LOCALIZER)
_SIGNALS: Final = (signal.SIGKILL, signal.SIGSTOP)
_FULL_SPEED_M_PER_S: Final = 0.5
_STANDS_M_PER_S: Final = 1e-6
_STARTS: Final = ('1.8,4.7,-90', '1.2,4.7,-80', '2.4,4.7,-100')
_WAIT_S: Final = 40.0
_PER_STACK: Final = 8
"""Every part is killed twice in one stack, far from the deaths after which it is given up."""


def measure_stops(
    times: int, *, domain: int, speed: float, seed: int, keep: Callable[[str, float], None]
) -> None:
    """Kill or stop controller or localizer at full speed, and time the robot.

    The launcher is held meanwhile: it would have replaced the part before the robot stands.

    Args:
        times: How often in all.
        domain: ROS domain of the stack.
        speed: Seconds of the graph's clock in one of the wall's.
        seed: Of the moments.
        keep: Called with what was done and the seconds of the graph's clock until the robot
            stood; infinite where it did not.

    Raises:
        GoalreachError: The stack does not drive.
    """
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        graph = BenchGraph(
            domain=domain, speed=speed, seed=seed, log_directory=Path(folder), gates=False
        )
        try:
            for number in range(times):
                if number % _PER_STACK == 0:
                    graph.stop()
                part, how = _PARTS[number % 2], _SIGNALS[number // 2 % 2]
                taken_s = None
                while taken_s is None:
                    if graph.stack is None or not graph.stack.alive:
                        graph.stop()
                        graph.start(*(word for start in _STARTS for word in ('--start', start)))
                    taken_s = _one(graph, part, how, rng)
                keep(f'{part} {how.name}', taken_s)
        finally:
            graph.close()


def _one(
    graph: BenchGraph, part: str, how: signal.Signals, rng: np.random.Generator
) -> float | None:
    """Return how long the robot took, or None where the launcher just replaced the part."""
    record = graph.record
    graph.serve(rng.uniform(0.0, 1.0) / graph.speed)
    fast = graph.serve_until(
        lambda: record.healthy_since is not None and record.speed_m_per_s > _FULL_SPEED_M_PER_S,
        _WAIT_S,
    )
    if not fast:
        raise GoalreachError('the robot does not come to full speed')
    graph.serve(rng.uniform(0.0, 0.04) / graph.speed)
    pid = graph.running.find_node(part)
    if pid is None:
        return None
    os.kill(graph.running.pid, signal.SIGSTOP)
    graph.running.send(part, how)
    moment_ns = time.time_ns()
    stood = graph.serve_until(lambda: record.speed_m_per_s < _STANDS_M_PER_S, _WAIT_S)
    began_ns = record.clock_at(moment_ns)
    taken_s = (record.clock_ns - began_ns) * 1e-9 if stood else float('inf')
    if how is signal.SIGSTOP:
        _let_go_on(pid)
    _let_go_on(graph.running.pid)
    record.end()
    graph.serve_until(lambda: record.healthy_since is not None, _WAIT_S)
    return round(taken_s, 6)


def _let_go_on(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGCONT)
