"""A page left open while a robot drives for a simulated day: memory of page and browser."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import contextlib
from dataclasses import dataclass
import os
from pathlib import Path
import statistics
import sys
import tempfile
import time
from typing import TYPE_CHECKING, Any, Final
import uuid

from goalreach_evaluation.results_file import ResultsFile
from goalreach_lab.options import BenchOptions
from goalreach_lab.rigs.processes import descendants_of, holdings_of
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study_file import code_version
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.files import write_text_atomically
from goalreach_msgs_py.options import option

if TYPE_CHECKING:
    from goalreach_lab.rigs.chromium import Page
    from goalreach_lab.rigs.dashboard_run import ClockedRun, ServedPage

SUMMARY = 'Leave a page open for a simulated day; what page and browser hold must stay flat'

_Typical = Callable[[Sequence[float]], float]

_MINUTE_S: Final = 60.0
_STALLED_S: Final = 120.0
_QUARTER_S: Final = 900.0
_WARM_S: Final = 120.0
"""Left out at the beginning: libraries are still being loaded, buffers filled."""
_HELD: Final[Mapping[str, tuple[str, str, float | None, _Typical]]] = {
    'page_mb': ('page, anonymous memory', 'MB', 1.05, statistics.median),
    'browser_mb': ('browser, anonymous memory', 'MB', None, statistics.median),
    'heap_mb': ("browser, the page's script heap, least", 'MB', 1.05, min),
    'nodes': ('browser, nodes of the document, least', '', 1.05, min),
    'handles': ('page, handles', '', 1.05, statistics.median),
    'threads': ('page, threads', '', 1.05, statistics.median),
}
"""Of the browser's scripts, the least of many samples counts: the others contain garbage of
frames that arrived since the last collection."""


@dataclass(frozen=True, kw_only=True)
class Options(BenchOptions):
    """Options of the suite."""

    hours: float = option(24.0, 'simulated hours', above=0.0, maximum=1000.0)
    rate: float = option(25.0, 'images in a simulated second', above=0.0, metavar='HZ')
    lines: Path | None = option(None, 'append a line of JSON each simulated minute')
    as_it_is: bool = option(False, 'report what is in --lines, drive nothing')

    def __post_init__(self) -> None:
        """Check that there are minutes to report."""
        super().__post_init__()
        if self.as_it_is and self.lines is None:
            raise ConfigurationError('--as-it-is', 'yes', 'together with --lines FILE')


def execute(options: Options) -> list[BenchRow]:
    """Drive, composed and in lockstep, with one page open; Ctrl-C ends it and reports.

    A page that was closed is another page: minutes driven later into the same file are a stretch
    of their own, and the longest stretch is reported: of this seed, rate and version of the code,
    or with --as-it-is of all.

    Raises:
        GoalreachError: An option is refused, there is no browser, or the run stalls.
    """
    file = ResultsFile(options.lines, key=('page', 'clock_s'))
    version = code_version('src', 'lab', 'examples')
    made = {'made_by': f'{version}, seed {options.seed}, {options.rate:g} Hz'}

    def keep(minute: dict[str, Any]) -> None:
        file.add(minute, minute | made)
        sys.stderr.write(_format(minute))

    if not options.as_it_is:
        with contextlib.suppress(KeyboardInterrupt):  # the minutes so far are worth their rows
            _watch_page(options.hours, rate_hz=options.rate, seed=options.seed, keep=keep)
    kept = [one for one in file.results if options.as_it_is or made.items() <= one.items()]
    return compare_ends(longest_stretch(kept))


def _format(minute: dict[str, Any]) -> str:
    return (
        f'{minute["clock_s"] / 3600:6.2f} h  page {minute["page_mb"]:.1f} MB  browser '
        f'{minute["browser_mb"]:.0f} MB, heap {minute["heap_mb"]:.2f} MB  '
        f'{minute["speed"]:.1f} x real time, {minute["frames"]} frames\n'
    )


def _watch_page(
    hours: float, *, rate_hz: float, seed: int, keep: Callable[[dict[str, Any]], None]
) -> None:
    """Drive, composed and in lockstep, with one page open in one browser.

    Args:
        hours: Simulated hours.
        rate_hz: Images in a simulated second: fewer make a day shorter.
        seed: Seed of the run.
        keep: Called with a sample once in a simulated minute.

    Raises:
        GoalreachError: There is no browser, or the run does not come up or stalls.
    """
    from goalreach_lab.rigs.chromium import ADVICE, is_installed, open_page
    from goalreach_lab.rigs.dashboard_run import clocked_run, served_page

    if not is_installed():
        raise GoalreachError(ADVICE)
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        parameters = Path(folder) / 'rate.yaml'
        write_text_atomically(
            parameters, f'nomad200:\n  ros__parameters:\n    camera_rate_hz: {rate_hz!r}\n'
        )
        words = ['--composed', '--clock', 'lockstep', '--seed', str(seed)]
        words += ['--params-file', str(parameters)]
        with (
            clocked_run(words) as run,
            served_page(run) as page,
            open_page(page.url, logs=False) as browser,
        ):
            sampler = _MinuteSampler(run, page, browser)
            while sampler.clock_s < 3600.0 * hours:
                keep(sampler.next())


class _MinuteSampler:
    """Samples a page once in a simulated minute.

    Attributes:
        clock_s: Simulated seconds since the page was opened.
    """

    def __init__(self, run: ClockedRun, page: ServedPage, browser: Page) -> None:
        self._run, self._page, self._browser = run, page, browser
        self._name = uuid.uuid4().hex[:8]
        self._opened_s, self._began_s = run.clock.now_s(), time.monotonic()
        self.clock_s, self._wall_s, self._frames = 0.0, 0.0, 0
        browser.count_frames()

    def next(self) -> dict[str, Any]:
        """Wait for the next minute; return its speed and frames, and what is held at its end."""
        self._run.clock.wait_until(self._opened_s + self.clock_s + _MINUTE_S, _STALLED_S)
        before_s, wall_s, shown = self.clock_s, self._wall_s, self._frames
        self.clock_s = self._run.clock.now_s() - self._opened_s
        self._wall_s = time.monotonic() - self._began_s
        self._frames = self._browser.frames()
        return {
            'page': self._name,
            'clock_s': round(self.clock_s, 2),
            'wall_s': round(self._wall_s, 1),
            'speed': round((self.clock_s - before_s) / (self._wall_s - wall_s), 2),
            'load': os.getloadavg()[0],
            'frames': self._frames - shown,
            **_holdings(self._page, self._browser),
        }


def _holdings(page: ServedPage, browser: Page) -> dict[str, float]:
    """Return what the page's process and its browser hold after a garbage collection."""
    browser.collect_garbage()
    own = holdings_of(page.pid)
    if own is None:
        raise GoalreachError('the page has ended')
    theirs = [holdings_of(pid) for pid in descendants_of(browser.pid)]
    return {
        'page_mb': own.memory_mb,
        'handles': own.handles,
        'threads': own.threads,
        'browser_mb': sum(one.memory_mb for one in theirs if one is not None),
        **browser.holdings(),
    }


def longest_stretch(minutes: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the minutes of the page that was open longest."""
    stretches: dict[object, list[dict[str, Any]]] = {}
    for minute in minutes:
        stretches.setdefault(minute['page'], []).append(minute)
    return max(stretches.values(), key=len, default=[])


def compare_ends(minutes: Sequence[dict[str, Any]]) -> list[BenchRow]:
    """Compare the last quarter of an hour with the first; quarters of the whole if shorter."""
    warm = [minute for minute in minutes if minute['clock_s'] >= _WARM_S]
    if not warm:
        return []
    began_s, ended_s = warm[0]['clock_s'], warm[-1]['clock_s']
    part_s = min(_QUARTER_S, (ended_s - began_s) / 4)
    first = [minute for minute in warm if minute['clock_s'] <= began_s + part_s]
    last = [minute for minute in warm if minute['clock_s'] >= ended_s - part_s]
    frames = sum(minute['frames'] for minute in minutes)
    note = f'{ended_s / 3600:.2f} h simulated, {frames:.0f} frames'
    rows = []
    for key, (name, unit, bound, typical) in _HELD.items():
        early, late = (typical([one[key] for one in part]) for part in (first, last))
        rows.append(
            BenchRow(
                name=name,
                unit=unit,
                ours=late,
                reference=early,
                reference_name=f'the first {part_s / 60:.0f} minutes after warming up',
                goal=None if bound is None else Goal(of='ratio', relation='<=', bound=bound),
                n=len(last),
                note=note,
            )
        )
    return rows
