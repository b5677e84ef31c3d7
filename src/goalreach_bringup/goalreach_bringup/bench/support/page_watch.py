"""Watches what a page and its browser hold, minute by minute of a robot's driving."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
import tempfile
import time
from typing import Any, Final
import uuid

from goalreach_bringup.bench.support.chromium import ADVICE, Page, is_there, open_page
from goalreach_bringup.bench.support.paged_run import LivePage, live_page, paged_run
from goalreach_bringup.faults.proc_file import descendants_of, holdings_of
from goalreach_bringup.run.domain_lock_file import free_domains
from goalreach_msgs_py.atomic_file import write_text_atomically
from goalreach_msgs_py.errors import GoalreachError

__all__ = ['watch_page']

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
            paged_run(words, domain=free_domains(1)[0]) as run,
            live_page(run) as page,
            open_page(page.url, logs=False) as browser,
        ):
            name, began_s = uuid.uuid4().hex[:8], time.monotonic()
            clock_s = opened_s = run.clock.now_s()
            while clock_s - opened_s < 3600.0 * hours:
                before_s, wall_s = clock_s, time.monotonic()
                browser.count_pictures()
                run.clock.wait_until(before_s + _MINUTE_S, _STALLED_S)
                clock_s = run.clock.now_s()
                speed = (clock_s - before_s) / (time.monotonic() - wall_s)
                seen = _holdings(page, browser)
                keep(
                    {
                        'page': name,
                        'clock_s': round(clock_s - opened_s, 2),
                        'wall_s': round(time.monotonic() - began_s, 1),
                        'speed': round(speed, 2),
                        'load': os.getloadavg()[0],
                        **seen,
                    }
                )


def _holdings(page: LivePage, browser: Page) -> dict[str, float]:
    """Return what the page's process and its browser hold; garbage is thrown away before."""
    pictures = browser.pictures()
    browser.collect_garbage()
    own = holdings_of(page.pid)
    if own is None:
        raise GoalreachError('the page has ended')
    theirs = [holdings_of(pid) for pid in descendants_of(browser.pid)]
    return {
        'pictures': pictures,
        'page_mb': own.memory_mb,
        'handles': own.handles,
        'threads': own.threads,
        'browser_mb': sum(one.memory_mb for one in theirs if one is not None),
        **browser.holdings(),
    }
