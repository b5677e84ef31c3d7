"""The dashboard: processor time of its process, frame rate in browsers, cost for the run."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import pairwise
import os
import statistics
import sys
import time
from typing import TYPE_CHECKING, Final

from goalreach_lab.options import BenchOptions
from goalreach_lab.row import BenchRow, Goal
from goalreach_msgs_py.options import option

if TYPE_CHECKING:
    from goalreach_lab.rigs.dashboard_run import ClockedRun, RunLoad


SUMMARY = 'Live page: its processor time, frames in 0, 1, 3 browsers, what it costs the run'

_SETTLE_S: Final = 3.0
_UPDATES_PER_S: Final = 20.0
"""A page asks for so many frames a second of the wall clock."""
_UPDATED: Final = Goal(of='ratio', relation='>=', bound=0.95)
"""The clocks of a browser and of the page may differ a little."""
_SPEED: Final = Goal(of='ratio', relation='>=', bound=0.75)
"""A page that is open may slow a lockstep run by a quarter."""
_WORDS: Final = {'composed': ['--composed'], 'processes': []}


@dataclass(frozen=True, kw_only=True)
class Options(BenchOptions):
    """Options of the suite."""

    seconds: float = option(6.0, 'length of each measurement', minimum=1.0)
    browsers: tuple[int, ...] = option((0, 1, 3), 'open at once', minimum=0, empty=True)
    rounds: int = option(11, 'measurements with the page', minimum=1)
    clients: int = option(3, 'open meanwhile; they paint nothing', minimum=1)
    nodes: tuple[str, ...] = option(
        tuple(_WORDS), 'runs whose speed is compared', choices=tuple(_WORDS), empty=True
    )


def execute(options: Options) -> list[BenchRow]:
    """Measure.

    Raises:
        GoalreachError: An option is refused, or a run or its page does not come up.
    """
    rows = _browser_rows(options)
    for nodes in options.nodes:
        rows += _lockstep_rows(options, nodes)
    return rows


def _browser_rows(options: Options) -> list[BenchRow]:
    """Measure the page of a run in real time, with some browsers open."""
    from goalreach_lab.rigs.chromium import ADVICE, is_installed
    from goalreach_lab.rigs.dashboard_run import clocked_run

    counts = [count for count in options.browsers if count == 0 or is_installed()]
    if len(counts) < len(options.browsers):
        sys.stderr.write(f'left out: {ADVICE}\n')
    rows: list[BenchRow] = []
    if counts:
        words = ['--clock', 'realtime', '--seed', str(options.seed)]
        with clocked_run(words) as run:
            for count in counts:
                rows += _with_browsers(run, count, options.seconds)
    return rows


def _with_browsers(run: ClockedRun, count: int, seconds: float) -> list[BenchRow]:
    from goalreach_lab.rigs.chromium import open_page
    from goalreach_lab.rigs.dashboard_run import measure_load, served_page

    with ExitStack() as stack:
        page = stack.enter_context(served_page(run))
        browsers = [stack.enter_context(open_page(page.url, logs=False)) for _ in range(count)]
        time.sleep(_SETTLE_S)
        for browser in browsers:
            browser.count_frames()
        seen = measure_load(run, seconds, [page.pid, *(browser.pid for browser in browsers)])
        rates = [browser.frames_per_s() for browser in browsers]
    painting = sum(seen.used_s[1:]) / seen.wall_s
    name = f'{count} browser{"" if count == 1 else "s"}, real time'
    rows = [
        BenchRow(
            name=f'{name}: the page',
            unit='cores',
            ours=seen.cores(0),
            note=f'browsers took {painting:.2f} cores; {_machine_load(seen)}',
        ),
        BenchRow(
            name=f'{name}: the run',
            unit='x real time',
            ours=seen.speed,
            reference=1.0,
            reference_name='requested',
        ),
    ]
    if rates:
        rows.insert(1, _frame_row(name, rates))
    return rows


def _frame_row(name: str, rates: Sequence[float]) -> BenchRow:
    return BenchRow(
        name=f'{name}: frames a second',
        unit='',
        ours=min(rates),
        reference=_UPDATES_PER_S,
        reference_name='requested',
        goal=_UPDATED,
        note='each: ' + ', '.join(f'{rate:.1f}' for rate in rates),
    )


def _machine_load(seen: RunLoad) -> str:
    return f'load {seen.load:.1f} on {os.cpu_count()} cores'


def _lockstep_rows(options: Options, nodes: str) -> list[BenchRow]:
    """Drive as fast as possible, alternately without the page and with it."""
    from goalreach_lab.rigs.dashboard_run import clocked_run

    words = ['--clock', 'lockstep', '--seed', str(options.seed), *_WORDS[nodes]]
    paged: list[RunLoad] = []
    rates: list[float] = []
    with clocked_run(words) as run:
        without = [_without_page(run, options.seconds)]
        for number in range(options.rounds):
            seen, rate = _with_clients(run, options)
            paged.append(seen)
            rates.append(rate)
            without.append(_without_page(run, options.seconds))
            sys.stderr.write(
                f'{nodes}, round {number + 1}: {seen.speed:.2f} x real time with the page, '
                f'{without[-2].speed:.2f} before, {without[-1].speed:.2f} after; '
                f'load {seen.load:.1f}\n'
            )
    return _compare(f'lockstep, {nodes}', without, paged, rates, options.clients)


def _without_page(run: ClockedRun, seconds: float) -> RunLoad:
    from goalreach_lab.rigs.dashboard_run import measure_load

    time.sleep(_SETTLE_S)
    return measure_load(run, seconds, [run.stack.pid])


def _with_clients(run: ClockedRun, options: Options) -> tuple[RunLoad, float]:
    """Return the load of the run and its page, and the frames a second of the slowest client."""
    from goalreach_lab.rigs.dashboard_clients import dashboard_clients
    from goalreach_lab.rigs.dashboard_run import measure_load, served_page

    with served_page(run) as page, dashboard_clients(page.url, options.clients) as clients:
        time.sleep(_SETTLE_S)
        before = [client.frames for client in clients]
        seen = measure_load(run, options.seconds, [run.stack.pid, page.pid])
        after = [client.frames for client in clients]
    gained = [late - early for late, early in zip(after, before, strict=True)]
    return seen, min(gained) / seen.wall_s


def _compare(
    name: str,
    without: Sequence[RunLoad],
    paged: Sequence[RunLoad],
    rates: Sequence[float],
    clients: int,
) -> list[BenchRow]:
    around = [(early.speed + late.speed) / 2.0 for early, late in pairwise(without)]
    shares = [seen.speed / base for seen, base in zip(paged, around, strict=True)]
    listed = ', '.join(f'{share:.3f}' for share in sorted(shares))
    note = f'each over the mean of before and after; ratio: median of {listed}; '
    speed = statistics.median(seen.speed for seen in paged)
    work = [[seen.used_s[0] / seen.clock_s for seen in some] for some in (paged, without)]
    return [
        BenchRow(
            name=f'{name}: the page',
            unit='cores',
            ours=statistics.median(seen.cores(1) for seen in paged),
            note=f'{clients} clients that paint nothing, {min(rates):.1f} frames a second',
        ),
        BenchRow(
            name=f'{name}: speed of the run with its page',
            unit='x real time',
            ours=speed,
            reference=speed / statistics.median(shares),
            reference_name='without',
            goal=_SPEED,
            n=len(shares),
            note=note + _machine_load(paged[-1]),
        ),
        BenchRow(
            name=f'{name}: processor time of the run in a simulated second',
            unit='s',
            ours=statistics.median(work[0]),
            reference=statistics.median(work[1]),
            reference_name='without',
            n=len(shares),
            note='cost of the page for the processes of the run',
        ),
    ]
