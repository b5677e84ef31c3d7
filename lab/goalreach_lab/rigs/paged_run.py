"""A run and its live page as processes of their own, watched from outside."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import os
from pathlib import Path
import re
import signal
import subprocess
import tempfile
import threading
import time
from typing import Final

from goalreach_lab.rigs.proc_file import descendants_of, processor_s
from goalreach_lab.rigs.ros_run_clock import RunClock
from goalreach_lab.rigs.stack import Stack, free_domains, goalreach_command, wait_or_kill
from goalreach_msgs_py.errors import GoalreachError

_UP_S: Final = 40.0
_BEGUN_S: Final = 2.0
_END_S: Final = 10.0


@dataclass(frozen=True, kw_only=True)
class PagedRun:
    """A run that drives.

    Attributes:
        stack: Its processes.
        clock: Its clock.
    """

    stack: Stack
    clock: RunClock


@dataclass(frozen=True, kw_only=True)
class LivePage:
    """The page of a run.

    Attributes:
        pid: Process id of what serves it.
        url: Its address.
    """

    pid: int
    url: str


@dataclass(frozen=True, kw_only=True)
class Look:
    """What was seen of processes for some time.

    Attributes:
        wall_s: How long.
        clock_s: Simulated seconds that passed.
        used_s: Processor time of each group of processes, s.
        load: Processes that wanted to run at its end, average of a minute.
    """

    wall_s: float
    clock_s: float
    used_s: tuple[float, ...]
    load: float

    @property
    def speed(self) -> float:
        """Simulated seconds in a second."""
        return self.clock_s / self.wall_s

    def cores(self, group: int) -> float:
        """Return the processor time of a group per time."""
        return self.used_s[group] / self.wall_s


@contextmanager
def paged_run(arguments: Sequence[str]) -> Iterator[PagedRun]:
    """Start `goalreach run` without a page and wait until it drives; end it after.

    Raises:
        GoalreachError: It does not come up.
    """
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        domain = free_domains(1)[0]
        clock = RunClock(domain)
        said: list[str] = []
        stack = Stack(
            ['--no-dashboard', '--starts', 'random', *arguments],
            domain=domain,
            log_directory=Path(folder),
            tell=said.append,
        )
        try:
            clock.wait_until(_BEGUN_S, _UP_S)
            yield PagedRun(stack=stack, clock=clock)
        except GoalreachError as error:
            raise GoalreachError(f'{error}; {"; ".join(said[-3:])}') from None
        finally:
            stack.stop()
            clock.close()


@contextmanager
def live_page(run: PagedRun) -> Iterator[LivePage]:
    """Serve the page of a run; end it after.

    Raises:
        GoalreachError: It does not come up.
    """
    process = subprocess.Popen(
        goalreach_command('dashboard', '--port', '0'),
        env=run.stack.environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield LivePage(pid=process.pid, url=_link(process))
    finally:
        process.send_signal(signal.SIGINT)
        wait_or_kill(process, _END_S)


def _link(process: subprocess.Popen[str]) -> str:
    """Return the address that a page tells; what it says after that is read and left."""
    lines = process.stdout or ()
    said = []
    for line in lines:
        said.append(line.strip())
        found = re.search(r'live page: (http://\S+)', line)
        if found:
            threading.Thread(target=list, args=(lines,), daemon=True).start()
            return found[1]
    raise GoalreachError(f'the page did not come up: {" ".join(said)}')


def look(run: PagedRun, seconds: float, groups: Sequence[int]) -> Look:
    """Look at a run for some time.

    Args:
        run: The run.
        seconds: How long.
        groups: Process ids; each stands for itself and its descendants.
    """
    families = [(pid, *descendants_of(pid)) for pid in groups]

    def used() -> list[float]:
        return [sum(map(processor_s, family)) for family in families]

    began_s, clock_s, before = time.monotonic(), run.clock.now_s(), used()
    time.sleep(seconds)
    wall_s, passed_s, after = time.monotonic() - began_s, run.clock.now_s() - clock_s, used()
    return Look(
        wall_s=wall_s,
        clock_s=passed_s,
        used_s=tuple(late - early for late, early in zip(after, before, strict=True)),
        load=os.getloadavg()[0],
    )
