"""A run that a person started at a terminal, and what its page keeps and can begin after it."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import csv
import io
import json
import os
from pathlib import Path
import pty
import re
import subprocess
import sys
import tarfile
import threading
import time

import psutil
import pytest

from browser import require_browser
from goalreach_lab.rigs.chromium import Page, open_page
from goalreach_lab.rigs.dashboard_clients import dashboard_clients
import graphs

pytestmark = pytest.mark.graph
_LIMIT_S = 90.0
_QUICK = ['run', '--dashboard', '--composed', '--speed', '2', '--start', '1.8,2.6,-90']
_SAVED = """
const done = arguments[arguments.length - 1], make = URL.createObjectURL;
URL.createObjectURL = (blob) => { blob.text().then(done); return make.call(URL, blob); };
arguments[0].click();
"""


class Terminal:
    """`goalreach` on a terminal of its own.

    Attributes:
        process: The process.
        text: What it has printed.
    """

    def __init__(self, arguments: list[str], home: Path) -> None:
        self._ours, theirs = pty.openpty()
        self.text = ''
        environment = graphs.graph_environment(graphs.fresh_domain(), home)
        environment |= {'COLUMNS': '200', 'ROS_HOME': str(home)}
        del environment['ROS_LOG_DIR']
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'goalreach_bringup.cli', *arguments],
            env=environment,
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            start_new_session=True,
        )
        os.close(theirs)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        with contextlib.suppress(OSError):  # the other end is closed
            while data := os.read(self._ours, 4096):
                self.text += data.decode(errors='replace')

    def until(self, words: str) -> bool:
        """Wait until it has printed some words."""
        deadline_s = time.monotonic() + _LIMIT_S
        while words not in self.text:
            if time.monotonic() > deadline_s or self.process.poll() is not None:
                return words in self.text
            self._reader.join(0.05)
        return True

    @property
    def url(self) -> str:
        assert self.until('#token='), self.text
        assert self.until('is up'), self.text
        return str(re.findall(r'http://\S+', self.text)[0])

    def close(self) -> None:
        """End it, whatever happens."""
        if self.process.poll() is None:
            self.process.terminate()
        try:
            self.process.wait(15.0)
        finally:
            self.process.kill()
            self._reader.join(5.0)
            os.close(self._ours)


@contextlib.contextmanager
def terminal(arguments: list[str], home: Path) -> Iterator[Terminal]:
    started = Terminal(arguments, home)
    try:
        yield started
    finally:
        started.close()


@pytest.fixture(scope='module')
def browser() -> Iterator[Page]:
    """Open a browser before the run begins, which may be over sooner than a browser opens."""
    require_browser()
    with open_page('about:blank', width=1366) as page:
        yield page


@pytest.fixture(scope='module')
def run(browser: Page, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Terminal]:
    home = tmp_path_factory.mktemp('run')
    arguments = [*_QUICK, '--paths', '2', '--record', str(home / 'bag')]
    with terminal(arguments, home) as started:
        browser.driver.get(started.url)
        yield started


@pytest.fixture(scope='module')
def page(browser: Page, run: Terminal) -> Page:
    """Wait on the page of the run until both paths are driven."""
    assert run.until('the live page stays until it is closed'), run.text
    assert browser.until(lambda: browser.text('status') == 'run ended')
    return browser


def show_form(page: Page) -> None:
    """Unfold what another run is begun with."""
    if not page.find('run-start').is_displayed():
        page.find('run-summary').click()


def saved(page: Page, name: str) -> str:
    """Return the file that a button saves."""
    return str(page.driver.execute_async_script(_SAVED, page.find(name)))


def node_of(process: subprocess.Popen[bytes], name: str) -> psutil.Process:
    """Return the process of a node as soon as it has its name, of which Linux keeps 15 letters."""
    deadline_s = time.monotonic() + _LIMIT_S
    while time.monotonic() < deadline_s:
        for child in psutil.Process(process.pid).children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):
                if child.name() == name[:15]:
                    return child
    raise AssertionError(name)


def test_what_is_still_coming_up_is_told(tmp_path: Path) -> None:
    require_browser()
    with terminal(['run', '--dashboard', '--start', '1.8,2.6,-90'], tmp_path) as started:
        localizer = node_of(started.process, 'landmark_localizer')
        localizer.suspend()
        with open_page(started.url, width=1366) as page:
            assert page.until(lambda: page.text('status') == 'coming up: 3 of 4 nodes')
            localizer.resume()
            assert page.until(lambda: page.text('status') == 'driving')


def test_the_page_stays_after_the_last_path(run: Terminal, page: Page) -> None:
    assert 'run ended: all paths driven. 2 of 2 reached the goal' in page.text('paths-note')
    assert not page.find('pause').is_enabled()
    assert 'grayscale' in page.find('nodes').value_of_css_property('filter')
    assert run.process.poll() is None


def test_the_summary_is_saved_as_json_and_csv(run: Terminal, page: Page) -> None:
    summary = json.loads(saved(page, 'save-json'))
    assert summary['summary'] == {'outcomes': {'goal': 2}, 'goals': 2, 'paths': 2}
    assert summary['end'] == 'all paths driven'
    rows = list(csv.DictReader(io.StringIO(saved(page, 'save-csv'))))
    assert [row['number'] for row in rows] == ['1', '2']
    for row, path in zip(rows, summary['paths'], strict=True):
        assert (float(row['x_m']), float(row['y_m']), float(row['heading_deg'])) == (1.8, 2.6, -90)
        assert float(row['duration_s']) == path['duration_s'] > 0.0
        assert f'{path["duration_s"]:.1f} s' in run.text
    table = page.find('paths-rows').text.splitlines()
    assert len(table) == 2
    assert all('1.80 m, 2.60 m, -90°' in line for line in table)


def test_the_bag_is_saved(page: Page, tmp_path: Path) -> None:
    page.driver.execute_cdp_cmd(
        'Browser.setDownloadBehavior', {'behavior': 'allow', 'downloadPath': str(tmp_path)}
    )
    page.find('save-bag').click()
    assert page.until((tmp_path / 'bag.tar').exists)
    with tarfile.open(tmp_path / 'bag.tar') as bag:
        names = bag.getnames()
        metadata = bag.extractfile('bag/metadata.yaml')
        assert metadata is not None
        assert b'rosbag2_bagfile_information' in metadata.read()
    assert sorted(names) == ['bag/bag_0.mcap', 'bag/metadata.yaml']


def test_what_another_run_cannot_be_is_refused(page: Page) -> None:
    show_form(page)
    page.driver.execute_script('arguments[0].value = "pose"', page.find('run-starts'))
    page.find('run-starts').send_keys('')
    page.driver.execute_script(
        'arguments[0].dispatchEvent(new Event("change"))', page.find('run-starts')
    )
    field = page.find('run-pose')
    assert field.get_property('value') == '1.78, 2.54, -90'
    page.driver.execute_script('arguments[0].value = "0.1, 2, 0"', field)
    page.find('run-start').click()
    assert page.until(lambda: page.text('answer').startswith('refused: '))
    assert 'on the free floor' in page.text('answer')
    assert page.text('status') == 'run ended'


def test_another_run_is_started_recorded_and_stopped(run: Terminal, page: Page) -> None:
    show_form(page)
    field = page.find('run-pose')
    page.driver.execute_script('arguments[0].value = "1.8, 2.6, -90"', field)
    page.find('run-start').click()
    assert page.until(lambda: page.text('status') == 'driving')
    assert page.until(lambda: page.find('paths-rows').text.count('-90°') >= 2)
    page.find('record').click()
    assert page.until(lambda: page.text('record') == 'Stop recording')
    bag = Path(page.text('bag-note').removeprefix('Recording into '))
    assert page.until(lambda: any(bag.glob('*.mcap')))
    page.find('record').click()
    assert page.until(lambda: page.text('record') == 'Record')
    assert (bag / 'metadata.yaml').exists()
    page.find('run-stop').click()
    assert page.until(lambda: page.text('status') == 'run ended')
    assert 'run ended: stopped' in page.text('paths-note')
    assert run.process.poll() is None
    logs = re.findall(r'logs, policy and parameters: (\S+)', run.text)
    assert len(logs) > 1
    assert len({Path(folder).parent for folder in logs}) == 1


def test_the_last_path_is_replayed(page: Page) -> None:
    page.driver.execute_script('document.activeElement.blur()')
    page.driver.find_element('css selector', 'body').send_keys('r')
    assert page.until(lambda: page.find('replay-pair').text.count('goal after') == 2)
    assert page.until(lambda: page.find('replay-time').get_property('value') == '1')
    figures = page.find('replay-pair').find_elements('css selector', 'figure')
    titles = [each.find_element('css selector', 'figcaption').text for each in figures]
    assert [title.partition(':')[0] for title in titles] == ['fuzzy', 'crisp']


def test_ctrl_c_ends_the_run_on_the_page(run: Terminal, page: Page) -> None:
    show_form(page)
    page.find('run-start').click()
    assert page.until(lambda: page.text('status') == 'driving')
    assert page.until(lambda: page.find('paths-rows').text != '')
    run.process.send_signal(2)
    assert page.until(lambda: page.text('status') == 'run ended')
    assert run.process.wait(_LIMIT_S) == 0
    assert page.until(
        lambda: 'lost' in page.driver.execute_script('return document.body.className')
    )
    assert page.text('status') == 'run ended'
    assert 'reached the goal' in page.text('paths-note')
    assert json.loads(saved(page, 'save-json'))['end'] == 'stopped'
    assert [line for line in page.errors() if 'WebSocket' not in line] == []


def test_a_page_that_is_closed_ends_the_command(tmp_path: Path) -> None:
    with terminal([*_QUICK, '--paths', '1'], tmp_path) as run:
        with dashboard_clients(run.url, 1):
            assert run.until('the live page stays until it is closed'), run.text
        assert run.process.wait(_LIMIT_S) == 0


def test_a_learning_robot_has_no_mode_and_lockstep_no_speed(tmp_path: Path) -> None:
    require_browser()
    words = ['run', '--dashboard', '--composed', '--learn', '--clock', 'lockstep']
    with terminal(words, tmp_path) as run, open_page(run.url) as page:
        assert page.until(lambda: page.text('status') == 'learning')
        assert page.until(lambda: page.text('speed') == 'lockstep')
        for name in ('mode-choice', 'speed-choice'):
            assert page.find(name).get_property('disabled'), name
            inputs = page.find(name).find_elements('css selector', 'input')
            assert not any(each.is_enabled() for each in inputs)
        assert not page.find('noise-choice').get_property('disabled')
        assert not page.find('record').is_enabled()


def test_the_model_of_a_planner_grows_on_the_page(tmp_path: Path) -> None:
    require_browser()
    learn = ['--learn', '--learner', 'planner', '--policy', str(tmp_path / 'learned.json')]
    words = ['run', '--dashboard', '--composed', '--clock', 'lockstep', '--seed', '1', *learn]
    with terminal(words, tmp_path) as run, open_page(run.url) as page:
        assert page.until(lambda: page.has('felt-wall'), _LIMIT_S)
        assert page.find('model').find_elements('css selector', '.known')
        assert page.until(
            lambda: re.fullmatch(
                r'[1-4] walls? felt, [3-9] regions, \d imagined',
                page.text('model-text'),
            ),
            _LIMIT_S,
        )
        assert page.errors() == []


def test_nobody_waits_for_a_page_that_is_not_open(tmp_path: Path) -> None:
    with terminal([*_QUICK, '--paths', '1'], tmp_path) as run:
        assert run.process.wait(_LIMIT_S) == 0
    assert '1 of 1 paths reached the goal' in run.text
    assert 'the live page stays' not in run.text
