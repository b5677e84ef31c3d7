"""A headless browser for tests: Debian's Chromium, installed where that is allowed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import json
import os
from pathlib import Path
import shutil
import subprocess
import sys
import tempfile
import time
from typing import Any
from urllib.parse import urlsplit

import pytest

ADVICE = 'needs Chromium and its driver: apt-get install chromium chromium-driver'
FLAGS = (
    '--headless',
    '--no-sandbox',
    '--disable-gpu',
    '--disable-quic',
    '--no-first-run',
    '--disable-background-networking',
    '--disable-component-update',
    '--disable-sync',
    '--lang=en-US',
)
_INSTALL_S = 600.0


def require_browser() -> None:
    """Make sure that there is a browser; else skip, or fail where CI=true."""
    if _is_there():
        return
    if os.geteuid() == 0 and shutil.which('apt-get'):
        _install()
    if _is_there():
        return
    if os.environ.get('CI') == 'true':
        pytest.fail(ADVICE)
    pytest.skip(ADVICE)


def _is_there() -> bool:
    try:
        import selenium  # noqa: F401
    except ModuleNotFoundError:
        return False
    return all(shutil.which(name) for name in ('chromium', 'chromedriver'))


def _install() -> None:
    for words in (['update'], ['install', '-y', 'chromium', 'chromium-driver']):
        sys.stderr.write(f'apt-get {" ".join(words)}\n')
        subprocess.run(
            ['apt-get', '-q', *words],
            check=False,
            stdout=subprocess.DEVNULL,
            timeout=_INSTALL_S,
            env={**os.environ, 'DEBIAN_FRONTEND': 'noninteractive'},
        )


class Page:
    """One browser window, by the names that the page gives its elements.

    Args:
        driver: Selenium's driver.
    """

    def __init__(self, driver: Any) -> None:  # noqa: ANN401 - has no stubs
        self.driver = driver

    def find(self, name: str) -> Any:  # noqa: ANN401 - the same
        """Return an element."""
        return self.driver.find_element('css selector', f'[data-testid="{name}"]')

    def has(self, name: str) -> bool:
        """Return whether there is such an element."""
        return bool(self.driver.find_elements('css selector', f'[data-testid="{name}"]'))

    def text(self, name: str) -> str:
        """Return what an element says."""
        return str(self.find(name).get_attribute('textContent'))

    def metres(self, name: str) -> float:
        """Return the length that an element shows."""
        return float(self.text(name).removesuffix(' m'))

    def choose(self, name: str, label: str) -> None:
        """Press the button of that label in a group."""
        buttons = self.find(name).find_elements('css selector', 'button')
        next(button for button in buttons if button.text == label).click()

    def until(self, condition: Callable[[], object], limit_s: float = 15.0) -> bool:
        """Return whether a condition held within the limit."""
        deadline_s = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > deadline_s:
                return False
            self.driver.execute_async_script('requestAnimationFrame(arguments[0])')
        return True

    def errors(self) -> list[str]:
        """Return the errors on the console since the last call."""
        entries = self.driver.get_log('browser')
        return [entry['message'] for entry in entries if entry['level'] == 'SEVERE']

    def hosts(self) -> set[str]:
        """Return the hosts that the browser asked for anything, since the last call."""
        hosts = set()
        for entry in self.driver.get_log('performance'):
            message = json.loads(entry['message'])['message']
            parameters = message['params']
            url = parameters.get('url') or parameters.get('request', {}).get('url', '')
            if message['method'] in ('Network.requestWillBeSent', 'Network.webSocketCreated'):
                parts = urlsplit(url)
                if parts.scheme in ('http', 'https', 'ws', 'wss'):
                    hosts.add(str(parts.hostname))
        return hosts


@contextmanager
def open_page(
    url: str, *, width: int = 1440, height: int = 900, dark: bool = False
) -> Iterator[Page]:
    """Open an address in a browser of its own, with an empty profile."""
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = Options()
        options.binary_location = str(shutil.which('chromium'))
        for flag in (*FLAGS, f'--user-data-dir={profile}', f'--window-size={width},{height}'):
            options.add_argument(flag)
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL', 'performance': 'ALL'})
        service = Service(str(Path(str(shutil.which('chromedriver')))))
        driver = webdriver.Chrome(options=options, service=service)
        try:
            scheme = {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}
            driver.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': [scheme]})
            size = {'width': width, 'height': height, 'deviceScaleFactor': 1, 'mobile': False}
            driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', size)
            driver.get(url)
            yield Page(driver)
        finally:
            driver.quit()
