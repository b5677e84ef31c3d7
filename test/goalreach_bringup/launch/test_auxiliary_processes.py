"""Page and recorder as processes of a run: what they are told, and what becomes of their end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import json
import logging
from pathlib import Path
import signal
import sys
import time
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock
from urllib.request import urlopen

import pytest

from goalreach_bringup.launch import auxiliary_processes, child_process
from goalreach_bringup.launch.auxiliary_processes import (
    PageProcess,
    RecorderProcess,
    is_page_wanted,
    require_page,
)
from goalreach_dashboard.address import TOKEN_VARIABLE
from goalreach_msgs_py.errors import GoalreachError

PROGRAM = f"""
import os, signal, socket, sys, time

def close(*_):
    print('3 messages', flush=True)
    os._exit(0)

def page(kind):
    print('token', os.environ['{TOKEN_VARIABLE}'])
    if kind == 'breaks':
        print('no socket', flush=True)
        return 3
    if kind == 'answers':
        connection, _ = socket.socket(fileno=int(sys.argv[-1])).accept()
        connection.recv(10_000)
        connection.sendall(b'HTTP/1.0 200 OK\\r\\n\\r\\nhello')
        connection.close()
    if kind != 'unseen':
        print('page: {{"viewers": 2}}')
    if kind == 'asks':
        print('page: {{"request": "stop"}}')
        print('a line of its own')
        print('page: {{"request": "start", "value": 1, "viewers": 1}}')
    print('ready', flush=True)
    if kind == 'closes':
        time.sleep(0.2)
        print('page: {{"viewers": 0}}', flush=True)
    time.sleep(60)

def main():
    print(*sys.argv[1:], flush=True)
    if sys.argv[1] == 'dashboard':
        return page(sys.argv[3])
    kind = os.path.basename(sys.argv[2])
    if kind == 'early':
        print('no space', flush=True)
        return 4
    if kind == 'whole':
        signal.signal(signal.SIGINT, close)
    if kind == 'stubborn':
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    print('ready', flush=True)
    time.sleep(60)
"""


@pytest.fixture
def processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """Let a program stand for the command line; end all processes that are put into the list."""
    (tmp_path / 'program_of_a_run.py').write_text(PROGRAM, encoding='utf-8')
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(auxiliary_processes, '_COMMAND_LINE', 'program_of_a_run')
    monkeypatch.setattr(auxiliary_processes, '_PAGE_CLOSED_S', 0.3)
    monkeypatch.setattr(auxiliary_processes, '_DRAIN_S', 1.0)
    monkeypatch.setattr(child_process, '_GRACE_S', 0.3)
    monkeypatch.setattr(child_process, '_KILL_S', 0.3)
    made: list[Any] = []
    yield made
    child_process.stop_all(made)


def wait_until(condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < deadline_s
        time.sleep(0.01)


@pytest.mark.parametrize(
    ('requested', 'clock', 'lacking', 'wanted'),
    [
        (None, 'realtime', '', True),
        (None, 'realtime', 'terminal', False),
        (None, 'lockstep', '', False),
        (None, 'realtime', 'uvicorn', False),
        (True, 'lockstep', 'terminal', True),
        (False, 'realtime', '', False),
        (False, 'realtime', 'uvicorn', False),
    ],
)
def test_a_page_is_for_a_person_who_has_its_libraries(
    requested: object, clock: str, lacking: str, wanted: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, 'stdout', Mock(isatty=lambda: lacking != 'terminal'))
    found = lambda name: None if name == lacking else name  # noqa: E731
    monkeypatch.setattr(auxiliary_processes, 'find_spec', found)
    assert is_page_wanted(requested=requested, clock=clock) is wanted  # type: ignore[arg-type]


def test_where_there_is_no_pip_its_place_is_taken_by_uv(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, 'prefix', str(tmp_path / 'environment'))
    monkeypatch.setattr(auxiliary_processes, 'find_spec', lambda _: None)
    cure = f'`uv pip install -p {sys.executable} starlette uvicorn websockets`'
    with pytest.raises(GoalreachError, match=f'{cure} installs it'):
        require_page()


def test_a_page_has_a_link_of_its_own_and_hears_of_the_run(
    processes: list[Any], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    page = PageProcess('answers', 'robot1', tmp_path)
    processes.append(page)
    page.report('path', length_m=1.5)
    page.report('end')
    lines = (tmp_path / 'page.jsonl').read_text().splitlines()
    assert [json.loads(line) for line in lines] == [
        {'event': 'path', 'length_m': 1.5},
        {'event': 'end'},
    ]
    address, _, token = caplog.messages[0].removeprefix('live page: ').partition('#token=')
    assert len(token) >= 16
    with urlopen(address, timeout=20.0) as answer:  # noqa: S310 - of this machine
        assert answer.read() == b'hello'
    wait_until(lambda: page.last_log_line() == 'ready')
    told = (tmp_path / 'dashboard.log').read_text().splitlines()
    words = f'dashboard --arena answers --robot robot1 --events {tmp_path}/page.jsonl --listener '
    assert told[0].startswith(words)
    assert told[1] == f'token {token}'
    page.stop()
    assert page.exit_status == -signal.SIGINT


def test_requests_of_a_page_are_told_from_its_other_lines(
    processes: list[Any], tmp_path: Path
) -> None:
    page = PageProcess('asks', '', tmp_path)
    processes.append(page)
    wait_until(lambda: (tmp_path / 'dashboard.log').read_text().endswith('ready\n'))
    start = {'request': 'start', 'value': 1, 'viewers': 1}
    assert page.poll() == [{'request': 'stop'}, start]
    assert page.poll() == []


def test_the_end_of_a_page_is_told_once_and_does_not_end_the_run(
    processes: list[Any], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    page = PageProcess('breaks', '', tmp_path)
    processes.append(page)
    assert page.wait(20.0)
    assert page.poll() == page.poll() == []
    assert [r.message for r in caplog.records if r.levelno == logging.ERROR] == [
        'dashboard: error: no socket'
    ]
    assert page.keep(stop=asked(requested=False)) is None


def asked(*, requested: bool) -> Any:  # noqa: ANN401 - stands for a StopRequest
    return SimpleNamespace(requested=requested)


@pytest.mark.parametrize(
    ('kind', 'kept'),
    [
        ('asks', {'request': 'start', 'value': 1, 'viewers': 1}),
        ('closes', None),
        ('unseen', None),
    ],
)
def test_a_page_is_kept_until_it_asks_for_something_or_is_closed(
    kind: str,
    kept: object,
    processes: list[Any],
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    page = PageProcess(kind, '', tmp_path)
    processes.append(page)
    wait_until(lambda: 'ready' in (tmp_path / 'dashboard.log').read_text())
    assert page.keep(asked(requested=True)) is None
    assert page.keep(asked(requested=False)) == kept
    stays = [line for line in caplog.messages if 'stays until it is closed' in line]
    assert len(stays) == (kind == 'closes')
    assert page.exit_status is None


def test_a_recorder_is_told_the_parameters_and_closes_its_bag(
    processes: list[Any], tmp_path: Path
) -> None:
    recorder = RecorderProcess(tmp_path / 'whole', 'mcap', tmp_path, '--robot', 'robot1')
    processes.append(recorder)
    wait_until(lambda: recorder.last_log_line() == 'ready')
    assert recorder.poll(began=False) == recorder.poll(began=True) == ''
    assert recorder.stop() == '3 messages'
    assert (recorder.failed, recorder.exit_status) == (False, 0)
    words = (tmp_path / 'recorder.log').read_text().splitlines()[0]
    given = f'--storage mcap --robot robot1 --parameters {tmp_path}/parameters.yaml'
    assert words == f'record {tmp_path}/whole {given}'


@pytest.mark.parametrize('kind', ['cut', 'stubborn'])
def test_a_recorder_that_is_killed_tells_how_its_bag_is_repaired(
    kind: str, processes: list[Any], tmp_path: Path
) -> None:
    recorder = RecorderProcess(tmp_path / kind, 'mcap', tmp_path)
    processes.append(recorder)
    wait_until(lambda: recorder.last_log_line() == 'ready')
    line = f'the recorder was killed: goalreach record --repair {tmp_path}/{kind}'
    assert recorder.stop() == line
    assert recorder.failed
    assert recorder.exit_status == (-signal.SIGINT if kind == 'cut' else -signal.SIGKILL)


def test_a_run_does_not_begin_without_its_recorder_but_goes_on(
    processes: list[Any], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    recorder = RecorderProcess(tmp_path / 'early', 'mcap', tmp_path)
    processes.append(recorder)
    assert recorder.wait(20.0)
    summary = 'ended with status 4: no space'
    with pytest.raises(GoalreachError, match=f'^the recorder {summary}$'):
        recorder.poll(began=False)
    assert recorder.poll(began=True) == f'the recorder {summary}'
    assert recorder.poll(began=True) == recorder.poll(began=False) == ''
    assert caplog.messages == [f'recorder: error: {summary}']
    assert recorder.stop() == 'no space'
    assert recorder.failed
