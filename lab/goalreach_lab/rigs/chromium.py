"""A headless Chromium, driven by Selenium: the dashboard as a user sees it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import json
from pathlib import Path
import shutil
import tempfile
import time
from typing import Any
from urllib.parse import urlsplit

ADVICE = 'needs Chromium and its driver: apt-get install chromium chromium-driver'
_FLAGS = (
    '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync',
    '--lang=en-US',
)  # fmt: skip
_COUNT = """
window.count?.observer.disconnect();
const count = window.count = {frames: 0, since: performance.now()};
count.observer = new MutationObserver(() => count.frames++);
const all = {subtree: true, childList: true, attributes: true, characterData: true};
count.observer.observe(document.querySelector('main'), all);
"""
"""The page applies a frame in one go, and each one changes something while a robot drives."""
_COUNTED = 'return [count.frames, (performance.now() - count.since) / 1000];'


def is_installed() -> bool:
    """Return whether browser, driver and Selenium are installed."""
    try:
        import selenium  # noqa: F401
    except ModuleNotFoundError:
        return False
    return all(shutil.which(name) for name in ('chromium', 'chromedriver'))


class Page:
    """One browser window; elements are found by their `data-testid`.

    Args:
        driver: Selenium's driver.
    """

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def find(self, name: str) -> Any:
        """Return an element."""
        return self.driver.find_element('css selector', f'[data-testid="{name}"]')

    def has(self, name: str) -> bool:
        """Return whether the page has an element."""
        return bool(self.driver.find_elements('css selector', f'[data-testid="{name}"]'))

    def text(self, name: str) -> str:
        """Return the text of an element."""
        return str(self.find(name).get_attribute('textContent'))

    def metres(self, name: str) -> float:
        """Return the length that an element shows."""
        return float(self.text(name).removesuffix(' m'))

    def choose(self, name: str, label: str) -> None:
        """Press the button with a label in a group."""
        buttons = self.find(name).find_elements('css selector', 'label')
        next(button for button in buttons if button.text == label).click()

    def chosen(self, name: str) -> str:
        """Return the value that a group of buttons shows as chosen, '' for none."""
        checked = self.find(name).find_elements('css selector', 'input:checked')
        return str(checked[0].get_attribute('value')) if checked else ''

    def shows(self, name: str, text: str) -> bool:
        """Wait until an element has a text; return whether it did in time."""
        return self.until(lambda: self.text(name) == text)

    def until(self, condition: Callable[[], object], limit_s: float = 90.0) -> bool:
        """Wait for a condition; return whether it held within the limit."""
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
        """Return the hosts that the browser contacted since the last call."""
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

    @property
    def pid(self) -> int:
        """Process id of the driver; the browser's processes descend from it."""
        return int(self.driver.service.process.pid)

    def count_frames(self) -> None:
        """Begin to count the frames of the page that this browser shows."""
        self.driver.execute_script(_COUNT)

    def frames(self) -> int:
        """Return the number of frames shown since then.

        A script run by the driver leaves a hundred bytes in the page's heap; this leaves none.
        """
        asked = {'expression': 'count.frames', 'returnByValue': True}
        answer = self.driver.execute_cdp_cmd('Runtime.evaluate', asked)
        return int(answer['result']['value'])

    def frames_per_s(self) -> float:
        """Return the number of frames a second since then."""
        frames, passed_s = self.driver.execute_script(_COUNTED)
        return float(frames / passed_s)

    def collect_garbage(self) -> None:
        """Run the garbage collector of the page's scripts."""
        self.driver.execute_cdp_cmd('HeapProfiler.collectGarbage', {})

    def holdings(self) -> dict[str, float]:
        """Return the script heap, MB, and the number of document nodes of the page."""
        metrics = self.driver.execute_cdp_cmd('Performance.getMetrics', {})['metrics']
        found = {metric['name']: float(metric['value']) for metric in metrics}
        return {'heap_mb': found['JSHeapUsedSize'] / 1e6, 'nodes': found['Nodes']}


@contextmanager
def open_page(
    url: str, *, width: int = 1440, height: int = 900, dark: bool = False, logs: bool = True
) -> Iterator[Page]:
    """Open an address in a browser with an empty profile; close it after.

    Args:
        url: The address.
        width: Width of the window, px.
        height: Its height, px.
        dark: Whether the user prefers a dark colour scheme.
        logs: Whether the driver keeps console and network logs, which grow with time.
    """
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = Options()
        options.binary_location = str(shutil.which('chromium'))
        for flag in (*_FLAGS, f'--user-data-dir={profile}', f'--window-size={width},{height}'):
            options.add_argument(flag)
        if logs:
            options.set_capability('goog:loggingPrefs', {'browser': 'ALL', 'performance': 'ALL'})
        service = Service(str(Path(str(shutil.which('chromedriver')))))
        driver = webdriver.Chrome(options=options, service=service)
        try:
            scheme = {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}
            driver.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': [scheme]})
            driver.execute_cdp_cmd('Performance.enable', {})
            size = {'width': width, 'height': height, 'deviceScaleFactor': 1, 'mobile': False}
            driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', size)
            driver.get(url)
            yield Page(driver)
        finally:
            driver.quit()
