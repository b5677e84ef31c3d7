"""A page left open while a robot drives for a simulated day: what page and browser hold."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
import contextlib
from pathlib import Path
import statistics
import sys
from typing import Any, Final

from goalreach_lab.row import BenchRow, Goal

SUMMARY = 'Leave a page open for a simulated day; what page and browser hold must stay flat'

_Typical = Callable[[Sequence[float]], float]

_QUARTER_S: Final = 900.0
_WARM_S: Final = 120.0
"""Left out at the beginning: libraries are still being loaded, buffers filled."""
_HELD: Final[Mapping[str, tuple[str, str, float | None, _Typical]]] = {
    'page_mb': ('page, memory of its own', 'MB', 1.05, statistics.median),
    'browser_mb': ('browser, memory of its own', 'MB', None, statistics.median),
    'heap_mb': ("browser, the page's script heap, least", 'MB', 1.05, min),
    'nodes': ('browser, nodes of the document, least', '', 1.05, min),
    'handles': ('page, handles', '', 1.05, statistics.median),
    'threads': ('page, threads', '', 1.05, statistics.median),
}
"""What the browser's scripts hold is the least of many looks: the others find the garbage of
pictures that came since it was last collected."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    add = parser.add_argument
    add('--hours', type=float, default=24.0, metavar='F', help='simulated hours')
    add('--rate', type=float, default=25.0, metavar='HZ', help='images in a simulated second')
    add('--lines', type=Path, metavar='FILE', help='append a line of JSON each simulated minute')
    add('--as-it-is', action='store_true', help='report what is in --lines, drive nothing')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Drive, composed and in lockstep, with one page open; Ctrl-C ends it with what there is.

    A page that was closed is another page: what is driven later into the same file is a stretch
    of its own, and the longest is reported.

    Raises:
        GoalreachError: An option is refused, there is no browser, or the run does not go on.
    """
    from goalreach_evaluation.summary_file import append_line, read_lines
    from goalreach_msgs_py.errors import ConfigurationError

    if not 0.0 < options.hours <= 1000.0:  # noqa: PLR2004 - 24 h a day
        raise ConfigurationError('--hours', options.hours, 'a number in (0, 1000]')
    if options.as_it_is and options.lines is None:
        raise ConfigurationError('--as-it-is', 'yes', 'together with --lines FILE')
    minutes = [] if options.lines is None else read_lines(options.lines)

    def keep(minute: dict[str, Any]) -> None:
        minutes.append(minute)
        if options.lines is not None:
            append_line(options.lines, minute)
        sys.stderr.write(_told(minute))

    if not options.as_it_is:
        from goalreach_lab.rigs.page_watch import watch_page

        with contextlib.suppress(KeyboardInterrupt):  # what has been seen is worth its rows
            watch_page(options.hours, rate_hz=options.rate, seed=options.seed, keep=keep)
    return rows_of(longest_stretch(minutes))


def _told(minute: dict[str, Any]) -> str:
    return (
        f'{minute["clock_s"] / 3600:6.2f} h  page {minute["page_mb"]:.1f} MB  browser '
        f'{minute["browser_mb"]:.0f} MB, heap {minute["heap_mb"]:.2f} MB  '
        f'{minute["speed"]:.1f} x real time, {minute["pictures"]} pictures\n'
    )


def longest_stretch(minutes: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the minutes of the page that was open longest."""
    stretches: dict[object, list[dict[str, Any]]] = {}
    for minute in minutes:
        stretches.setdefault(minute['page'], []).append(minute)
    return max(stretches.values(), key=len, default=[])


def rows_of(minutes: Sequence[dict[str, Any]]) -> list[BenchRow]:
    """Hold the end against the first quarter of an hour, or against a quarter if it is shorter."""
    warm = [minute for minute in minutes if minute['clock_s'] >= _WARM_S]
    if not warm:
        return []
    began_s, ended_s = warm[0]['clock_s'], warm[-1]['clock_s']
    part_s = min(_QUARTER_S, (ended_s - began_s) / 4)
    first = [minute for minute in warm if minute['clock_s'] <= began_s + part_s]
    last = [minute for minute in warm if minute['clock_s'] >= ended_s - part_s]
    pictures = sum(minute['pictures'] for minute in minutes)
    note = f'{ended_s / 3600:.2f} h simulated, {pictures:.0f} pictures'
    rows = []
    for key, (name, unit, bound, typical) in _HELD.items():
        early, late = (typical([one[key] for one in part]) for part in (first, last))
        goal = None if bound is None else Goal(of='ratio', relation='<=', bound=bound)
        rows.append(
            BenchRow(
                name=name,
                unit=unit,
                ours=late,
                reference=early,
                reference_name=f'the first {part_s / 60:.0f} minutes after warming up',
                goal=goal,
                n=len(last),
                note=note,
            )
        )
    return rows
