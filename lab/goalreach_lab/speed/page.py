"""The live page: processor time of its process, pictures in browsers, speed it costs a run."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import ExitStack
from itertools import pairwise
import os
import statistics
import sys
import time
from typing import TYPE_CHECKING, Final

from goalreach_lab.row import BenchRow, Goal

if TYPE_CHECKING:
    from goalreach_lab.rigs.paged_run import Look, PagedRun


SUMMARY = 'Live page: its processor time, pictures in 0, 1, 3 browsers, what it costs the run'

_SETTLE_S: Final = 3.0
_MOST_CORES: Final = Goal(of='ours', relation='<=', bound=0.5)
_PICTURES: Final = Goal(of='ours', relation='>=', bound=19.0)
"""20 a second, less what a browser's clock and the page's may differ."""
_SPEED: Final = Goal(of='ratio', relation='>=', bound=0.95)
_WORDS: Final = {'composed': ['--composed'], 'processes': []}


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    add = parser.add_argument
    add('--seconds', type=float, default=6.0, metavar='F', help='length of each look')
    add('--browsers', type=int, nargs='*', default=[0, 1, 3], metavar='N', help='open at once')
    add('--rounds', type=int, default=11, metavar='N', help='looks with the page')
    add('--clients', type=int, default=3, metavar='N', help='open meanwhile; they paint nothing')
    add(
        '--nodes',
        nargs='*',
        choices=tuple(_WORDS),
        default=list(_WORDS),
        help='runs whose speed is compared',
    )


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Measure.

    Raises:
        GoalreachError: An option is refused, or a run or its page does not come up.
    """
    from goalreach_msgs_py.errors import ConfigurationError

    for name, least in (('seconds', 1.0), ('rounds', 1), ('clients', 1)):
        if getattr(options, name) < least:
            raise ConfigurationError(f'--{name}', getattr(options, name), f'at least {least:g}')
    rows = _browsers(options)
    for nodes in options.nodes:
        rows += _lockstep(options, nodes)
    return rows


def _tell(text: str) -> None:
    sys.stderr.write(f'{text}\n')


def _browsers(options: argparse.Namespace) -> list[BenchRow]:
    """Look at the page of a run in real time, with some browsers open."""
    from goalreach_lab.rigs.chromium import ADVICE, is_there
    from goalreach_lab.rigs.paged_run import paged_run

    counts = [count for count in options.browsers if count == 0 or is_there()]
    if len(counts) < len(options.browsers):
        _tell(f'left out: {ADVICE}')
    rows: list[BenchRow] = []
    if counts:
        words = ['--clock', 'realtime', '--seed', str(options.seed)]
        with paged_run(words) as run:
            for count in counts:
                rows += _with_browsers(run, count, options.seconds)
    return rows


def _with_browsers(run: PagedRun, count: int, seconds: float) -> list[BenchRow]:
    from goalreach_lab.rigs.chromium import open_page
    from goalreach_lab.rigs.paged_run import live_page, look

    with ExitStack() as stack:
        page = stack.enter_context(live_page(run))
        browsers = [stack.enter_context(open_page(page.url, logs=False)) for _ in range(count)]
        time.sleep(_SETTLE_S)
        for browser in browsers:
            browser.count_pictures()
        seen = look(run, seconds, [page.pid, *(browser.pid for browser in browsers)])
        rates = [browser.pictures_per_s() for browser in browsers]
    painting = sum(seen.used_s[1:]) / seen.wall_s
    name = f'{count} browser{"" if count == 1 else "s"}, real time'
    note = f'browsers took {painting:.2f} cores; {_surroundings(seen)}'
    rows = [
        _row(f'{name}: the page', 'cores', seen.cores(0), _MOST_CORES, note),
        _row(f'{name}: the run', 'x real time', seen.speed, None, 'asked for: 1'),
    ]
    if rates:
        told = 'each: ' + ', '.join(f'{rate:.1f}' for rate in rates)
        rows.insert(1, _row(f'{name}: pictures a second', '', min(rates), _PICTURES, told))
    return rows


def _row(name: str, unit: str, ours: float, goal: Goal | None, note: str) -> BenchRow:
    return BenchRow(name=name, unit=unit, ours=ours, goal=goal, note=note)


def _surroundings(seen: Look) -> str:
    return f'load {seen.load:.1f} on {os.cpu_count()} cores'


def _lockstep(options: argparse.Namespace, nodes: str) -> list[BenchRow]:
    """Drive as fast as it goes, by turns without the page and with it."""
    from goalreach_lab.rigs.paged_run import paged_run

    words = ['--clock', 'lockstep', '--seed', str(options.seed), *_WORDS[nodes]]
    paged: list[Look] = []
    rates: list[float] = []
    with paged_run(words) as run:
        without = [_alone(run, options.seconds)]
        for number in range(options.rounds):
            seen, rate = _with_clients(run, options)
            paged.append(seen)
            rates.append(rate)
            without.append(_alone(run, options.seconds))
            _tell(
                f'{nodes}, round {number + 1}: {seen.speed:.2f} x real time with the page, '
                f'{without[-2].speed:.2f} before, {without[-1].speed:.2f} after; '
                f'load {seen.load:.1f}'
            )
    return _compared(f'lockstep, {nodes}', without, paged, rates, options.clients)


def _alone(run: PagedRun, seconds: float) -> Look:
    from goalreach_lab.rigs.paged_run import look

    time.sleep(_SETTLE_S)
    return look(run, seconds, [run.stack.pid])


def _with_clients(run: PagedRun, options: argparse.Namespace) -> tuple[Look, float]:
    """Return what was seen of the run and its page, and the pictures a second of one client."""
    from goalreach_lab.rigs.page_clients import page_clients
    from goalreach_lab.rigs.paged_run import live_page, look

    with live_page(run) as page, page_clients(page.url, options.clients) as clients:
        time.sleep(_SETTLE_S)
        before = [client.pictures for client in clients]
        seen = look(run, options.seconds, [run.stack.pid, page.pid])
        after = [client.pictures for client in clients]
    gained = [late - early for late, early in zip(after, before, strict=True)]
    return seen, min(gained) / seen.wall_s


def _compared(
    name: str, without: Sequence[Look], paged: Sequence[Look], rates: Sequence[float], clients: int
) -> list[BenchRow]:
    around = [(early.speed + late.speed) / 2.0 for early, late in pairwise(without)]
    shares = [look.speed / base for look, base in zip(paged, around, strict=True)]
    spread = ', '.join(f'{share:.3f}' for share in sorted(shares))
    speeds = [[look.speed for look in looks] for looks in (paged, without)]
    work = [[look.used_s[0] / look.clock_s for look in looks] for looks in (paged, without)]
    opened = f'{clients} clients that paint nothing, {min(rates):.1f} pictures a second'
    return [
        _row(
            f'{name}: the page',
            'cores',
            statistics.median(look.cores(1) for look in paged),
            _MOST_CORES,
            opened,
        ),
        BenchRow(
            name=f'{name}: speed of the run with its page',
            unit='x real time',
            ours=statistics.median(speeds[0]),
            reference=statistics.median(speeds[0]) / statistics.median(shares),
            reference_name='without',
            goal=_SPEED,
            n=len(shares),
            note=(
                'each by the mean of before and after; ratio: median of '
                f'{spread}; {_surroundings(paged[-1])}'
            ),
        ),
        BenchRow(
            name=f'{name}: processor time of the run in a simulated second',
            unit='s',
            ours=statistics.median(work[0]),
            reference=statistics.median(work[1]),
            reference_name='without',
            n=len(shares),
            note='what the page costs the run itself, whatever else the machine does',
        ),
    ]
