"""Makes the pictures of the live page anew, where `run_tests.py` has set up `.venv`:

PYTHONPATH=lab .venv/bin/python test/support/page_pictures.py [FOLDER]

Without FOLDER they replace those in `docs/figures`; with one, the states at the width of a phone
are made too. Each is taken of a real run in Chromium.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import re
import signal
import sys
import tempfile
import time

from goalreach_lab.rigs.chromium import Page, open_page
from goalreach_lab.rigs.processes import find_descendant
import graphs

ROOT = Path(__file__).resolve().parents[2]
_SETTLED_S = 6.0


@contextmanager
def _run(*arguments: str) -> Iterator[tuple[int, str]]:
    """Start a run; give the process id of its launcher and its link."""
    with tempfile.TemporaryDirectory(prefix='goalreach-') as home:
        words = ['run', '--dashboard', *arguments]
        domain = graphs.fresh_domain()
        with graphs.goalreach(words, domain=domain, home=Path(home)) as process:
            for line in process.stdout or ():
                if found := re.search(r'live page: (http://\S+)', line):
                    yield process.pid, found[1]
                    return


class Album:
    """Takes pictures of pages.

    Args:
        folder: Where they go.
        phone: Whether each is also taken at the width of a phone.
    """

    def __init__(self, folder: Path, *, phone: bool) -> None:
        self._folder = folder
        self._phone = phone

    def take(self, page: Page, name: str, *, top: str = 'status') -> None:
        """Take a picture at the width of a laptop, and at that of a phone where wanted.

        The window is scrolled to the section that holds the element `top`.
        """
        sizes = {'': (1440, 900)}
        if self._phone:
            sizes = {'_phone': (390, 844), **sizes}
        for suffix, (width, height) in sizes.items():
            size = {'width': width, 'height': height, 'deviceScaleFactor': 1, 'mobile': False}
            page.driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', size)
            script = '(arguments[0].closest("section") || document.body).scrollIntoView()'
            page.driver.execute_script(script, page.find(top))
            path = self._folder / f'{name}{suffix}.png'
            page.driver.save_screenshot(str(path))
            if self._phone:
                tall = page.driver.execute_script('return document.documentElement.scrollHeight')
                clip = {'x': 0, 'y': 0, 'width': width, 'height': tall, 'scale': 1}
                shot = page.driver.execute_cdp_cmd(
                    'Page.captureScreenshot', {'captureBeyondViewport': True, 'clip': clip}
                )
                whole = path.with_stem(f'{path.stem}_whole')
                whole.write_bytes(base64.b64decode(shot['data']))

    def driving(self) -> None:
        """A run in real time: fuzzy, crisp and dark, paused, placing, silent, ended."""
        words = ('--policy', 'paper', '--start', '0.6,4.5,-90', '--speed', '2')
        with _run(*words) as (pid, url), open_page(url) as page:
            page.until(lambda: page.text('status') == 'driving')
            page.until(lambda: page.text('path') == '3')
            time.sleep(_SETTLED_S / 2)
            self.take(page, 'dashboard_fuzzy')
            page.find('pause').click()
            page.until(lambda: page.text('status') == 'paused')
            page.find('place-switch').click()
            if self._phone:
                self.take(page, 'dashboard_placing')
            page.find('place-cancel').click()
            page.find('pause').click()
            page.choose('mode-choice', 'crisp')
            page.choose('theme', 'dark')
            page.until(lambda: page.text('path') == '4')
            time.sleep(_SETTLED_S / 2)
            self.take(page, 'dashboard_crisp')
            page.choose('theme', 'auto')
            node = 'landmark_localizer'
            for _ in range(3):  # a third restart is delayed
                page.until(lambda: find_descendant(pid, node) is not None)
                os.kill(int(str(find_descendant(pid, node))), signal.SIGKILL)
                time.sleep(0.5)
            page.until(lambda: 'silent' in page.text('status'))
            self.take(page, 'dashboard_dead_node')
            page.until(lambda: page.text('status') == 'driving')
            page.find('replay').click()
            page.until(lambda: page.find('replay-time').get_property('value') == '1')
            os.kill(pid, signal.SIGTERM)
            page.until(lambda: page.text('status') == 'run ended')
            self.take(page, 'dashboard_ended', top='replay')

    def learning(self) -> None:
        """A run that learns, in lockstep."""
        words = ('--learn', '--clock', 'lockstep', '--composed')
        with _run(*words) as (_, url), open_page(url) as page:
            page.until(lambda: page.text('trial').isdigit() and int(page.text('trial')) >= 3)
            self.take(page, 'dashboard_learning')


def main(folder: Path | None) -> None:
    """Make the pictures."""
    album = Album(folder or ROOT / 'docs' / 'figures', phone=folder is not None)
    album.driving()
    album.learning()


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
