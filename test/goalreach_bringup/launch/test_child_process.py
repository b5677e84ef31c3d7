"""A child process of the launcher: log, signals, exit status."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import logging
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import psutil
import pytest

from goalreach_bringup.launch.child_process import ChildProcess, stop_all

PROGRAM = """
import signal, sys, time

def main():
    print('[WARN] [1.5] [a_node]: slow', file=sys.stderr)
    print('arguments', *sys.argv[1:])
    if 'ignore' in sys.argv:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    print('ready', flush=True)
    if 'wait' in sys.argv:
        time.sleep(60)
    return 3
"""
LAUNCHER = """
import os, sys, time
from pathlib import Path
from goalreach_bringup.launch.child_process import ChildProcess

child = ChildProcess('child', 'program', ['wait'], log_path=Path(sys.argv[1]))
time.sleep(60)
"""

Start = Callable[..., ChildProcess]


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    (tmp_path / 'program.py').write_text(PROGRAM, encoding='utf-8')
    monkeypatch.syspath_prepend(str(tmp_path))
    children: list[ChildProcess] = []

    def run(*arguments: str) -> ChildProcess:
        path = tmp_path / f'child{len(children)}.log'
        variables = {'PYTHONUNBUFFERED': '1'}
        children.append(
            ChildProcess('child', 'program', arguments, log_path=path, variables=variables)
        )
        return children[-1]

    yield run
    stop_all(children)


def wait_for_line(child: ChildProcess, text: str) -> None:
    deadline_s = time.monotonic() + 20.0
    while child.last_log_line() != text:
        assert time.monotonic() < deadline_s, child.exit_summary()
        time.sleep(0.02)


def test_its_output_goes_to_the_log_and_its_warnings_are_reported(
    start: Start, caplog: pytest.LogCaptureFixture
) -> None:
    child = start('one', 'two')
    assert child.wait(20.0)
    assert child.read_log() == ['[WARN] [1.5] [a_node]: slow', 'arguments one two', 'ready']
    assert (child.exit_status, child.exit_summary()) == (3, 'ended with status 3: ready')
    assert caplog.record_tuples == [
        ('goalreach_bringup.launch.child_process', logging.WARNING, 'a_node: warn: slow')
    ]


def test_a_signal_that_ended_it_is_named(start: Start) -> None:
    child = start('wait')
    wait_for_line(child, 'ready')
    child.signal(signal.SIGKILL)
    assert child.wait(20.0)
    assert child.exit_summary() == 'was ended by SIGKILL'


def test_one_that_ignores_signals_is_killed(start: Start) -> None:
    willing, stubborn = start('wait'), start('wait', 'ignore')
    wait_for_line(stubborn, 'ready')
    assert stop_all([willing, stubborn]) == ['child']
    assert stubborn.exit_status == -signal.SIGKILL


def test_it_ends_with_its_launcher_a_script_without_a_guard(start: Start, tmp_path: Path) -> None:
    del start  # it has written the program
    path = tmp_path / 'launcher.log'
    script = tmp_path / 'launcher.py'
    script.write_text(LAUNCHER, encoding='utf-8')
    command = [sys.executable, str(script), str(path)]
    environment = {**os.environ, 'PYTHONPATH': f'{tmp_path}:{os.environ.get("PYTHONPATH", "")}'}
    with subprocess.Popen(command, env=environment) as launcher:
        deadline_s = time.monotonic() + 20.0
        while not (path.exists() and 'ready' in path.read_text(encoding='utf-8')):
            assert time.monotonic() < deadline_s
            time.sleep(0.02)
        descendants = psutil.Process(launcher.pid).children(recursive=True)
        assert descendants
        launcher.kill()
    _, alive = psutil.wait_procs(descendants, timeout=10.0)
    assert alive == []
