"""Starting and ending a stack over and over, by every signal, at random moments."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
from dataclasses import asdict, dataclass
import os
from pathlib import Path
import signal
import subprocess
import tempfile
import time
from typing import Any, Final

import numpy as np

from goalreach_bringup.launch.environment import abandoned_files
from goalreach_lab.rigs.processes import processes_with
from goalreach_lab.rigs.stack import start_command, wait_or_kill

_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
_DRIVES_S: Final = 60.0
_GONE_S: Final = 10.0
_EARLY: Final = 4
"""Every fourth round is ended while it comes up; chosen."""

_MARK: Final = 'ROS_LOG_DIR'


@dataclass(frozen=True, kw_only=True)
class Round:
    """One start and stop.

    Attributes:
        signal: How it was ended.
        early: Whether it was ended while it came up.
        drove: Whether it drove a path; True where it was ended before it could.
        survivors: Processes alive after their launcher.
        said: What it said, where it did not drive.
    """

    signal: str
    early: bool
    drove: bool
    survivors: int
    said: str = ''

    def to_json(self) -> dict[str, Any]:
        """Return it as plain values."""
        return asdict(self)


def run_rounds(
    times: int, *, domain: int, rng: np.random.Generator, keep: Callable[[Round], None]
) -> int:
    """Start and stop, then start and stop once more in peace.

    The next start comes at once, while the processes of the last may still be ending.

    Args:
        times: How often.
        domain: ROS domain.
        rng: Of the moments.
        keep: Called with each round.

    Returns:
        Files in shared memory that are abandoned after the last stop.
    """
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        marks: list[tuple[Path, signal.Signals, bool, bool, str]] = []
        for number in range(times):
            number_of_signal = _SIGNALS[number % len(_SIGNALS)]
            early = number % _EARLY == _EARLY - 1
            mark = Path(folder) / f'round-{number}'
            drove, said = _round(mark, domain, number_of_signal, rng, early=early)
            marks.append((mark, number_of_signal, early, drove, said))
            if len(marks) > 1:
                keep(_judge(*marks.pop(0)))
        for one in marks:
            keep(_judge(*one))
        _round(Path(folder) / 'last', domain, signal.SIGINT, rng, early=False)
    return len(abandoned_files())


def _round(
    mark: Path, domain: int, number: signal.Signals, rng: np.random.Generator, *, early: bool
) -> tuple[bool, str]:
    """Start, wait until it drives, end it; return whether it drove and what it said."""
    mark.mkdir()
    log = mark / 'said'
    environment = {
        **os.environ, _MARK: str(mark), 'ROS_DOMAIN_ID': str(domain), 'NO_COLOR': '1'
    }  # fmt: skip
    with log.open('w', encoding='utf-8') as stream:
        words = ('run', '--clock', 'lockstep', '--start', '1.8,2.4,-90')
        process = start_command(*words, environment=environment, output=stream)
        drove = True
        if early:
            time.sleep(rng.uniform(0.1, 2.0))
        else:
            drove = _wait_for_path(process, log)
            time.sleep(rng.uniform(0.0, 0.3))
        if process.poll() is None:
            process.send_signal(number)
        drove &= wait_or_kill(process, _GONE_S)
    said = log.read_text(encoding='utf-8', errors='replace')
    return drove, '' if drove else said


def _wait_for_path(process: subprocess.Popen[str], log: Path) -> bool:
    deadline_s = time.monotonic() + _DRIVES_S
    while time.monotonic() < deadline_s and process.poll() is None:
        if ' goal ' in log.read_text(encoding='utf-8', errors='replace'):
            return True
        time.sleep(0.05)
    return False


def _judge(mark: Path, number: signal.Signals, early: bool, drove: bool, said: str) -> Round:  # noqa: FBT001 - a row of a list
    """Return what came of a round; by now all of it should have ended."""
    deadline_s = time.monotonic() + _GONE_S
    while (left := processes_with(_MARK, str(mark))) and time.monotonic() < deadline_s:
        time.sleep(0.1)
    for pid in left:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return Round(
        signal=signal.Signals(number).name,
        early=early,
        drove=drove,
        survivors=len(left),
        said=said[-2000:],
    )
