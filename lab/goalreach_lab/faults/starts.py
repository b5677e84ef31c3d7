"""Starts and stops of the whole stack: surviving processes, and the effect on the next start."""

from collections.abc import Iterator, Sequence
import contextlib
from dataclasses import dataclass
from functools import partial
import os
from pathlib import Path
import signal
import subprocess
import tempfile
import time
from typing import Any, Final

import numpy as np

from goalreach_bringup.launch.environment import abandoned_files
from goalreach_lab.options import BenchOptions
from goalreach_lab.rigs.processes import processes_with
from goalreach_lab.rigs.stack import free_domains, start_command, wait_or_kill
from goalreach_lab.row import BenchRow
from goalreach_lab.study import Case, Study, run_study
from goalreach_msgs_py.options import option

SUMMARY = 'Start and stop the stack by SIGINT, SIGTERM and SIGKILL of its launcher, in turn'

_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
_DRIVES_S: Final = 60.0
_GONE_S: Final = 10.0
_EARLY: Final = 4
"""Every fourth round is ended while the stack starts; chosen."""

_MARK: Final = 'ROS_LOG_DIR'
_KEPT_LETTERS: Final = 2000


@dataclass(frozen=True, kw_only=True)
class Options(BenchOptions):
    """Options of the suite."""

    times: int = option(12, 'starts and stops', minimum=1)
    results: Path | None = option(None, 'keep rounds there, and resume', metavar='DIR')


def execute(options: Options) -> list[BenchRow]:
    """Start and stop, and count what is left.

    Raises:
        GoalreachError: A file of results is refused or cannot be written.
    """
    domain = free_domains(1)[0]
    study = Study(
        name='starts',
        key=('round',),
        cases=[{'round': number} for number in range(options.times)],
        measure=partial(run_rounds, domain=domain, seed=options.seed),
        seed=options.seed,
    )
    rounds = run_study(study, options.results)
    note = f'{sum(one["early"] for one in rounds)} rounds ended while the stack started'
    row = partial(BenchRow.none_allowed, n=len(rounds), note=note)
    return [
        row('processes that survived their launcher', sum(one['survivors'] for one in rounds)),
        row('starts that did not drive a path', sum(not one['drove'] for one in rounds)),
        row('abandoned files in shared memory', count_abandoned(domain, options.seed)),
    ]


def run_rounds(
    cases: Sequence[Case], *, domain: int, seed: int
) -> Iterator[tuple[Case, dict[str, Any]]]:
    """Start and stop the stack; the next start follows at once, while processes may still end.

    Args:
        cases: Their `round` decides the signal, and whether the stack is ended while it starts.
        domain: ROS domain.
        seed: Seed of the moments.

    Yields:
        Each case with `signal`, `early`, whether it `drove` a path (True where it was ended
        before), the number of `survivors` of its launcher, and the `output` where it did not.
    """
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        before: tuple[Case, Path, dict[str, Any]] | None = None
        for case in cases:
            directory = Path(folder) / f'round-{case["round"]}'
            result = _run_round(directory, domain, case['round'], seed)
            if before is not None:
                yield _finish(*before)
            before = (case, directory, result)
        if before is not None:
            yield _finish(*before)


def count_abandoned(domain: int, seed: int) -> int:
    """Return the abandoned files in shared memory after one more start and a regular stop."""
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        _run_round(Path(folder) / 'last', domain, 0, seed)
    return len(abandoned_files())


def _run_round(directory: Path, domain: int, number: int, seed: int) -> dict[str, Any]:
    """Start, wait until it drives, and end it."""
    how, early = _SIGNALS[number % len(_SIGNALS)], number % _EARLY == _EARLY - 1
    rng = np.random.default_rng([seed, number])
    directory.mkdir()
    log = directory / 'output'
    environment = {
        **os.environ, _MARK: str(directory), 'ROS_DOMAIN_ID': str(domain), 'NO_COLOR': '1'
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
            process.send_signal(how)
        drove &= wait_or_kill(process, _GONE_S)
    output = '' if drove else log.read_text(encoding='utf-8', errors='replace')[-_KEPT_LETTERS:]
    return {'signal': how.name, 'early': early, 'drove': drove, 'output': output}


def _wait_for_path(process: subprocess.Popen[str], log: Path) -> bool:
    deadline_s = time.monotonic() + _DRIVES_S
    while time.monotonic() < deadline_s and process.poll() is None:
        if ' goal ' in log.read_text(encoding='utf-8', errors='replace'):
            return True
        time.sleep(0.05)
    return False


def _finish(case: Case, directory: Path, result: dict[str, Any]) -> tuple[Case, dict[str, Any]]:
    """Add the processes that are left of a round, which should all have ended, and kill them."""
    deadline_s = time.monotonic() + _GONE_S
    while (left := processes_with(_MARK, str(directory))) and time.monotonic() < deadline_s:
        time.sleep(0.1)
    for pid in left:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return case, {**result, 'survivors': len(left)}
