"""The running graph against the bare relay: ticks, latency, processor time, memory, start."""

from collections.abc import Callable
import statistics
from typing import Any, Final

import numpy as np

from goalreach_lab.rigs.graph_test_rig import GraphTestRig
from goalreach_lab.rigs.processes import CpuMeter, descendants_of, proportional_mb
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.speed.driving import frame_ms
from goalreach_lab.speed.measurement import Budget, spread
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.topics import NODES

_PERIOD_MS: Final = 40.0
_ROUNDS: Final = 3
_STARTS: Final = 12
_DEPTH: Final = 10
"""Queue of the stopped reader: RViz's."""
_RELAY: Final = 'bare relay'
_BARE: Final = 'four bare nodes'
_LOCKSTEP: Final = ('--clock', 'lockstep', '--starts', 'random')
_REAL_TIME: Final = ('--clock', 'realtime', '--starts', 'random')


def lockstep_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of the wall time of a lockstep tick, with four processes and composed."""
    seed = ('--seed', str(budget.seed))
    seconds = budget.seconds(6.0)
    four: list[float] = []
    four_floor: list[float] = []
    one: list[float] = []
    one_floor: list[float] = []
    with GraphTestRig.open() as rig:
        for _ in range(budget.count(_ROUNDS)):
            with rig.relay('lockstep'):
                four_floor.append(_tick_ms(rig.measure('ticks', seconds)))
            with rig.stack(*_LOCKSTEP, *seed):
                four.append(_tick_ms(rig.measure('ticks', seconds)))
            with rig.relay('lockstep', composed=True):
                one_floor.append(_tick_ms(rig.measure('ticks', seconds)))
            with rig.stack(*_LOCKSTEP, *seed, '--composed'):
                one.append(_tick_ms(rig.measure('ticks', seconds)))
    return [
        _row('lockstep tick, four processes', 'ms', four, four_floor, bound=1.6),
        _row('lockstep tick, composed', 'ms', one, one_floor, bound=1.8),
        BenchRow(
            name='lockstep, composed, times real time at 25 Hz',
            unit='times',
            ours=_PERIOD_MS / statistics.median(one),
            n=len(one),
            note=spread([_PERIOD_MS / took_ms for took_ms in one]),
        ),
        BenchRow(
            name='computation of a frame in one process, without ROS',
            unit='ms',
            ours=frame_ms(budget.seed),
            note='processor time',
        ),
    ]


def _tick_ms(seen: dict[str, Any]) -> float:
    (first_ns, last_ns), (first_s, last_s) = seen['stamps_ns'], seen['times_s']
    if last_ns <= first_ns:
        raise GoalreachError('the graph under test stopped ticking')
    return float((last_s - first_s) * _PERIOD_MS * 1e9 / (last_ns - first_ns))


def _row(
    name: str,
    unit: str,
    ours: list[float],
    floor: list[float],
    *,
    floor_name: str = _RELAY,
    bound: float | None = None,
    note: str = '',
) -> BenchRow:
    """Return the row of medians over rounds, with a bound of their ratio."""
    return BenchRow(
        name=name,
        unit=unit,
        ours=statistics.median(ours),
        reference=statistics.median(floor),
        reference_name=floor_name,
        goal=None if bound is None else Goal(of='ratio', relation='<=', bound=bound),
        n=len(ours),
        note=spread(ours, floor) + note,
    )


def real_time_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of a graph in real time: latency, processor time, memory."""
    seconds = budget.seconds(10.0)
    relay, bare, ours = _Measured(), _Measured(), _Measured()
    by_node: dict[str, list[float]] = {name: [] for name in NODES}
    with GraphTestRig.open() as rig:
        for _ in range(budget.count(_ROUNDS)):
            with rig.relay('realtime') as pids:
                relay.add_latency(rig, pids, seconds)
            with rig.bare_nodes() as pids:
                rig.measure('nodes', len(NODES))
                bare.memory_mb.append(proportional_mb(pids))
            with rig.stack(*_REAL_TIME, '--seed', str(budget.seed)) as stack:
                stack.wait_for_nodes()
                pids = [stack.pid, *descendants_of(stack.pid)]
                ours.add_latency(rig, pids, seconds)
                ours.memory_mb.append(proportional_mb(pids))
                for name in NODES:
                    by_node[name].append(proportional_mb([stack.node_pid(name)]))
    nodes = ', '.join(f'{name} {statistics.median(mb):.0f}' for name, mb in by_node.items())
    return [
        _latency_row('p50', 50.0, ours.took_ms, relay.took_ms, bound=1.5),
        _latency_row('p99', 99.0, ours.took_ms, relay.took_ms, bound=2.0),
        _row(
            'processor time of the whole stack in real time at 25 Hz',
            '% of a core',
            ours.cpu_percent,
            relay.cpu_percent,
            note='; ours: four nodes and the launcher',
        ),
        _row(
            'memory of the whole stack, proportional set size',
            'MB',
            ours.memory_mb,
            bare.memory_mb,
            floor_name=_BARE,
            note=f'; {nodes}',
        ),
    ]


class _Measured:
    """Measurements of a graph, of all rounds."""

    def __init__(self) -> None:
        self.took_ms: list[float] = []
        self.cpu_percent: list[float] = []
        self.memory_mb: list[float] = []

    def add_latency(self, rig: GraphTestRig, pids: list[int], seconds: float) -> None:
        """Measure the latency of a running graph, and the processor time of its processes."""
        meter = CpuMeter(pids)
        self.took_ms += rig.measure('latency', seconds)['took_ms']
        self.cpu_percent.append(100.0 * meter.cores)


def _latency_row(
    name: str, percent: float, ours_ms: list[float], floor_ms: list[float], *, bound: float
) -> BenchRow:
    if not (ours_ms and floor_ms):
        raise GoalreachError('the graph under test answered no image')
    return BenchRow(
        name=f'image to command in real time, {name}',
        unit='ms',
        ours=float(np.percentile(ours_ms, percent)),
        reference=float(np.percentile(floor_ms, percent)),
        reference_name=_RELAY,
        goal=Goal(of='ratio', relation='<=', bound=bound),
        n=len(ours_ms),
    )


def reader_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of the time of a tick while a reliable reader of images is stopped."""
    seconds, rows = budget.seconds(10.0), []
    for name, words, bound in (('lockstep', _LOCKSTEP, 1.1), ('real time', _REAL_TIME, 1.01)):
        stopped: list[float] = []
        alone: list[float] = []
        with GraphTestRig.open() as rig, rig.stack(*words, '--seed', str(budget.seed)):
            for _ in range(budget.count(2 * _ROUNDS)):
                alone.append(_tick_ms(rig.measure('ticks', seconds)))
                with rig.probe('stops', _DEPTH, stock=True) as probe:
                    if not probe.read()['stopped']:
                        raise GoalreachError('no image reaches the reader that is to stop')
                    stopped.append(_tick_ms(rig.measure('ticks', seconds)))
        title = f'tick while a reader of images is stopped, {name}'
        rows.append(_row(title, 'ms', stopped, alone, floor_name='no reader', bound=bound))
    return rows


def start_rows(budget: Budget) -> list[BenchRow]:
    """Return the row of the time from the command to the first motion."""
    ours, floor = [], []
    with GraphTestRig.open() as rig:
        for _ in range(budget.count(_STARTS)):
            floor.append(_until_s(rig, 'nodes', len(NODES), rig.bare_nodes))
            ours.append(_until_s(rig, 'motion', 0, lambda: rig.stack('--clock', 'realtime')))
    note = '; a policy is learned first'
    return [
        _row('start to first motion', 's', ours, floor, floor_name=_BARE, bound=1.6, note=note)
    ]


def _until_s(rig: GraphTestRig, kind: str, number: float, graph: Callable[[], Any]) -> float:
    """Return the time from the start of a graph until the probe has seen an event."""
    with rig.probe(kind, number) as probe:
        probe.read()
        with graph():
            at_s = probe.read()['at_s']
    if at_s is None:
        raise GoalreachError('the graph under test did not come up')
    return float(at_s - rig.began_s)
