"""A run with its recorder, watched from outside: processor time, memory, what is in the bag."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
import json
import os
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import Final

from goalreach_bags.decode import stamp_of
from goalreach_bags.reader import BagReader
from goalreach_bags.recording import LOST_KEY, TICK_TOPICS
from goalreach_lab.rigs.proc_file import children_of, processor_s
from goalreach_msgs_py.errors import GoalreachError

_START_S: Final = 30.0
_END_S: Final = 60.0
_SAMPLE_S: Final = 0.5
_WRITES: Final = 1_000_000
"""A recorder whose bag is so large, bytes, is at work."""

_SETTLED: Final = 0.2
"""Memory is compared from this part of the run on: before, buffers are still being filled."""


@dataclass(frozen=True, kw_only=True)
class RecordedRun:
    """What was seen of a recorder.

    Attributes:
        cores: Processor time per time.
        growth_mb: Resident memory gained from the settled beginning to the end.
        peak_mb: Most resident memory.
        watched_s: How long it was watched.
    """

    cores: float
    growth_mb: float
    peak_mb: float
    watched_s: float


@contextmanager
def running_stack(bag: Path, *, seed: int, clock: str) -> Iterator[subprocess.Popen[str]]:
    """Run `goalreach run --record` without end, in a process of its own."""
    command = [sys.executable, '-m', 'goalreach_bringup.cli', 'run', '--quiet']
    command += ['--seed', str(seed), '--clock', clock, '--starts', 'random']
    process = subprocess.Popen(
        [*command, '--record', str(bag)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.communicate(timeout=_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def find_recorder(stack: subprocess.Popen[str], bag: Path) -> int:
    """Return the process id of a stack's recorder, once it writes.

    Raises:
        GoalreachError: It does not, in time.
    """
    deadline_s = time.monotonic() + _START_S
    while time.monotonic() < deadline_s and stack.poll() is None:
        written = sum(path.stat().st_size for path in bag.glob('*'))
        for child in children_of(stack.pid):
            words = Path(f'/proc/{child}/cmdline').read_bytes().split(b'\0')
            if b'record' in words and written > _WRITES:
                return child
        time.sleep(0.05)
    raise GoalreachError('the recorder of the run did not come up')


def watch_run(pid: int, seconds: float) -> RecordedRun:
    """Look at a recorder for some time."""
    began_s, used_before_s = time.monotonic(), processor_s(pid)
    memory_mb = []
    while time.monotonic() - began_s < seconds:
        time.sleep(_SAMPLE_S)
        memory_mb.append(_resident_mb(pid))
    watched_s = time.monotonic() - began_s
    used_s = processor_s(pid) - used_before_s
    settled = memory_mb[int(_SETTLED * len(memory_mb)) :]
    return RecordedRun(
        cores=used_s / watched_s,
        growth_mb=settled[-1] - settled[0],
        peak_mb=max(memory_mb),
        watched_s=watched_s,
    )


def _resident_mb(pid: int) -> float:
    pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 1e6


def lost_messages(bag: BagReader) -> dict[str, int]:
    """Return by topic how many messages the recorder missed, by the numbers publishers give them.

    Raises:
        GoalreachError: The recording was not finished.
    """
    if LOST_KEY not in bag.custom:
        raise GoalreachError(f'{bag.path}: was not finished')
    lost: dict[str, int] = json.loads(bag.custom[LOST_KEY])
    return lost


def unanswered_ticks(bag: BagReader) -> dict[str, int]:
    """Return by topic how many ticks of the clock have no message in the bag.

    A node that is behind in real time leaves out an image; the recorder has then lost nothing,
    since nothing was sent. The first tick and the last may be there in part: the run was ended
    by hand.
    """
    stamps: dict[str, set[int]] = {name: set() for name in TICK_TOPICS}
    for message in bag.messages(TICK_TOPICS):
        stamps[message.topic].add(stamp_of(message.data))
    ticks = set(sorted(stamps['/clock'])[:-3])
    absent = {name: len(ticks - found) for name, found in stamps.items()}
    return {name: count for name, count in absent.items() if count}
