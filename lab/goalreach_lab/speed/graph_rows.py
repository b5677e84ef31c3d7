"""The running graph beside the bare relay: ticks, latency, processor, memory, start."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import statistics
import time
from typing import Any, Final

from goalreach_lab.rigs.proc_file import children_of, holdings_of, processor_s
from goalreach_lab.rigs.stand import Stand
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.speed.budget import Budget
from goalreach_lab.speed.core_rows import frame_ms
from goalreach_lab.speed.samples import percentile, spread
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.topics import NODES

_PERIOD_MS: Final = 40.0
_ROUNDS: Final = 3
_STARTS: Final = 5
_RELAY: Final = 'bare relay'
_LOCKSTEP: Final = ('--clock', 'lockstep', '--starts', 'random')
_REAL_TIME: Final = ('--clock', 'realtime', '--starts', 'random')


def lockstep_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of the wall time of a lockstep tick, by processes and composed."""
    seed = ('--seed', str(budget.seed))
    seconds = budget.seconds(6.0)
    figures: dict[str, list[float]] = {}
    with Stand.ready() as stand:
        for _ in range(budget.count(_ROUNDS)):
            for name, composed in (('processes', False), ('composed', True)):
                more = ('--composed',) if composed else ()
                with stand.relay('lockstep', composed=composed):
                    floor = _tick_ms(stand.look('ticks', seconds))
                with stand.stack(*_LOCKSTEP, *seed, *more):
                    ours = _tick_ms(stand.look('ticks', seconds))
                figures.setdefault(f'{name} floor', []).append(floor)
                figures.setdefault(name, []).append(ours)
    four, one = figures['processes'], figures['composed']
    return [
        _tick_row('lockstep tick, four processes', four, figures['processes floor'], 1.6),
        _tick_row('lockstep tick, composed', one, figures['composed floor'], 1.8),
        BenchRow(
            name='lockstep, composed, times real time at 25 Hz',
            unit='times',
            ours=_PERIOD_MS / statistics.median(one),
            goal=Goal(of='ours', relation='>=', bound=20.0),
            n=len(one),
            note=spread([_PERIOD_MS / took_ms for took_ms in one]),
        ),
        BenchRow(
            name='the computing of a frame in one process, without ROS',
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


def _tick_row(name: str, ours: list[float], floor: list[float], bound: float) -> BenchRow:
    return BenchRow(
        name=name,
        unit='ms',
        ours=statistics.median(ours),
        reference=statistics.median(floor),
        reference_name=_RELAY,
        goal=Goal(of='ratio', relation='<=', bound=bound),
        n=len(ours),
        note=spread(ours, floor),
    )


def real_time_rows(budget: Budget) -> list[BenchRow]:
    """Return the rows of a graph in real time: latency, processor, memory."""
    seconds = budget.seconds(10.0)
    floor_ms: list[float] = []
    ours_ms: list[float] = []
    cores: list[float] = []
    memory: dict[str, list[float]] = {}
    bare_mb: list[float] = []
    with Stand.ready() as stand:
        for _ in range(budget.count(_ROUNDS)):
            with stand.relay('realtime'):
                floor_ms += stand.look('latency', seconds)['took_ms']
            with stand.bare() as pids:
                stand.look('nodes', len(NODES))
                bare_mb += _memory_mb(pids)
            with stand.stack(*_REAL_TIME, '--seed', str(budget.seed)) as stack:
                stack.wait_for_nodes()
                pids = [stack.pid, *children_of(stack.pid)]
                watch = _Processor(pids)
                ours_ms += stand.look('latency', seconds)['took_ms']
                cores.append(watch.cores())
                for name in NODES:
                    memory.setdefault(name, []).extend(_memory_mb([stack.node_pid(name)]))
    return [
        _latency_row('p50', 50.0, ours_ms, floor_ms, bound_ms=1.5),
        _latency_row('p99', 99.0, ours_ms, floor_ms, bound_ms=3.0),
        BenchRow(
            name='processor time of the whole stack in real time at 25 Hz',
            unit='% of a core',
            ours=100.0 * statistics.median(cores),
            goal=Goal(of='ours', relation='<=', bound=60.0),
            n=len(cores),
            note='four nodes and the launcher; ' + spread([100.0 * one for one in cores]),
        ),
        _memory_row(memory, bare_mb),
    ]


class _Processor:
    """Processor time of processes since it was made."""

    def __init__(self, pids: Sequence[int]) -> None:
        self._pids = pids
        self._began_s, self._before_s = time.monotonic(), sum(map(processor_s, pids))

    def cores(self) -> float:
        """Return how many cores the processes kept busy."""
        used_s = sum(map(processor_s, self._pids)) - self._before_s
        return used_s / (time.monotonic() - self._began_s)


def _memory_mb(pids: Sequence[int]) -> list[float]:
    return [held.memory_mb for held in map(holdings_of, pids) if held is not None]


def _latency_row(
    name: str, percent: float, ours_ms: list[float], floor_ms: list[float], *, bound_ms: float
) -> BenchRow:
    if not (ours_ms and floor_ms):
        raise GoalreachError('the graph under test answered no image')
    ours, floor = percentile(ours_ms, percent), percentile(floor_ms, percent)
    return BenchRow(
        name=f'image to command in real time beyond the bare relay, {name}',
        unit='ms',
        ours=ours - floor,
        goal=Goal(of='ours', relation='<=', bound=bound_ms),
        n=len(ours_ms),
        note=f'{ours:.2f} ms, relay {floor:.2f} ms',
    )


def _memory_row(memory: dict[str, list[float]], bare_mb: list[float]) -> BenchRow:
    bare = statistics.median(bare_mb)
    by_node = {name: statistics.median(values) - bare for name, values in memory.items()}
    return BenchRow(
        name='memory of the largest node beyond a bare node',
        unit='MB',
        ours=max(by_node.values()),
        goal=Goal(of='ours', relation='<=', bound=60.0),
        n=len(bare_mb) // len(NODES),
        note=f'bare {bare:.0f} MB; '
        + ', '.join(f'{name} +{more:.0f}' for name, more in by_node.items()),
    )


def start_rows(budget: Budget) -> list[BenchRow]:
    """Return the row of the time from the command to the first motion."""
    ours, floor = [], []
    with Stand.ready() as stand:
        for _ in range(budget.count(_STARTS)):
            floor.append(_until(stand, 'nodes', len(NODES), stand.bare))
            ours.append(_until(stand, 'motion', 0, lambda: stand.stack('--clock', 'realtime')))
    more_s = statistics.median(ours) - statistics.median(floor)
    return [
        BenchRow(
            name='start to first motion beyond importing rclpy and finding four bare nodes',
            unit='s',
            ours=more_s,
            goal=Goal(of='ours', relation='<=', bound=1.5),
            n=len(ours),
            note=f'{statistics.median(ours):.2f} s, {spread(ours)}; '
            f'bare {statistics.median(floor):.2f} s, {spread(floor)}; a policy is learned first',
        )
    ]


def _until(stand: Stand, kind: str, number: float, graph: Callable[[], Any]) -> float:
    """Return how long a graph takes from its start until the probe has seen something."""
    with stand.probe(kind, number) as probe:
        probe.read()
        with graph():
            at_s = probe.read()['at_s']
    if at_s is None:
        raise GoalreachError('the graph under test did not come up')
    return float(at_s - stand.began_s)
