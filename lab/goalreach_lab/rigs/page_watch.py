"""Watches what a page and its browser hold, minute by minute of a robot's driving."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
import tempfile
import time
from typing import Any, Final
import uuid

from goalreach_lab.rigs.chromium import ADVICE, Page, is_there, open_page
from goalreach_lab.rigs.paged_run import LivePage, PagedRun, live_page, paged_run
from goalreach_lab.rigs.proc_file import descendants_of, holdings_of
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.files import write_text_atomically

_MINUTE_S: Final = 60.0
_STALLED_S: Final = 120.0


def watch_page(
    hours: float, *, rate_hz: float, seed: int, keep: Callable[[dict[str, Any]], None]
) -> None:
    """Drive, composed and in lockstep, with one page open in one browser.

    Args:
        hours: Simulated hours.
        rate_hz: Images in a simulated second: fewer make a day shorter.
        seed: Of the run.
        keep: Called with what was seen, once in a simulated minute.

    Raises:
        GoalreachError: There is no browser, or the run does not come up or go on.
    """
    if not is_there():
        raise GoalreachError(ADVICE)
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        parameters = Path(folder) / 'rate.yaml'
        write_text_atomically(
            parameters, f'nomad200:\n  ros__parameters:\n    camera_rate_hz: {rate_hz!r}\n'
        )
        words = ['--composed', '--clock', 'lockstep', '--seed', str(seed)]
        words += ['--params-file', str(parameters)]
        with (
            paged_run(words) as run,
            live_page(run) as page,
            open_page(page.url, logs=False) as browser,
        ):
            minutes = _Minutes(run, page, browser)
            while minutes.clock_s < 3600.0 * hours:
                keep(minutes.next())


class _Minutes:
    """Looks at a page once in a simulated minute.

    Attributes:
        clock_s: Simulated seconds since the page was opened.
    """

    def __init__(self, run: PagedRun, page: LivePage, browser: Page) -> None:
        self._run, self._page, self._browser = run, page, browser
        self._name = uuid.uuid4().hex[:8]
        self._opened_s, self._began_s = run.clock.now_s(), time.monotonic()
        self.clock_s, self._wall_s, self._pictures = 0.0, 0.0, 0
        browser.count_pictures()

    def next(self) -> dict[str, Any]:
        """Wait for the next minute; return what was seen since the last and what is held now."""
        self._run.clock.wait_until(self._opened_s + self.clock_s + _MINUTE_S, _STALLED_S)
        before_s, wall_s, shown = self.clock_s, self._wall_s, self._pictures
        self.clock_s = self._run.clock.now_s() - self._opened_s
        self._wall_s = time.monotonic() - self._began_s
        self._pictures = self._browser.pictures()
        return {
            'page': self._name,
            'clock_s': round(self.clock_s, 2),
            'wall_s': round(self._wall_s, 1),
            'speed': round((self.clock_s - before_s) / (self._wall_s - wall_s), 2),
            'load': os.getloadavg()[0],
            'pictures': self._pictures - shown,
            **_holdings(self._page, self._browser),
        }


def _holdings(page: LivePage, browser: Page) -> dict[str, float]:
    """Return what the page's process and its browser hold; garbage is thrown away before."""
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
