"""A run and its dashboard as processes of their own, measured from outside."""

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

from goalreach_lab.rigs.processes import CpuMeter, descendants_of
from goalreach_lab.rigs.ros_run_clock import RunClock
from goalreach_lab.rigs.stack import Stack, free_domains, start_command, wait_or_kill
from goalreach_msgs_py.errors import GoalreachError

_UP_S: Final = 40.0
_BEGUN_S: Final = 2.0
_END_S: Final = 10.0


@dataclass(frozen=True, kw_only=True)
class ClockedRun:
    """A run that drives: its processes and its clock."""

    stack: Stack
    clock: RunClock


@dataclass(frozen=True, kw_only=True)
class ServedPage:
    """The page of a run: the id of the process that serves it, and its address."""

    pid: int
    url: str


@dataclass(frozen=True, kw_only=True)
class RunLoad:
    """Speed and processor time of a run over some time.

    Attributes:
        wall_s: Duration.
        clock_s: Simulated seconds that passed.
        used_s: Processor time of each group of processes, s.
        load: Load average of the machine at its end, over one minute.
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
def clocked_run(arguments: Sequence[str]) -> Iterator[ClockedRun]:
    """Start `goalreach run` without a page and wait until it drives; end it after.

    Raises:
        GoalreachError: It does not come up.
    """
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        domain = free_domains(1)[0]
        clock = RunClock(domain)
        words = ['--no-dashboard', '--starts', 'random', *arguments]
        stack = Stack(words, domain=domain, log_directory=Path(folder))
        try:
            clock.wait_until(_BEGUN_S, _UP_S)
            yield ClockedRun(stack=stack, clock=clock)
        except GoalreachError as error:
            raise GoalreachError(f'{error}; {"; ".join(list(stack.lines)[-3:])}') from None
        finally:
            stack.stop()
            clock.close()


@contextmanager
def served_page(run: ClockedRun) -> Iterator[ServedPage]:
    """Serve the page of a run; end it after.

    Raises:
        GoalreachError: It does not come up.
    """
    process = start_command('dashboard', '--port', '0', environment=run.stack.environment)
    try:
        yield ServedPage(pid=process.pid, url=_wait_for_url(process))
    finally:
        process.send_signal(signal.SIGINT)
        wait_or_kill(process, _END_S)


def _wait_for_url(process: subprocess.Popen[str]) -> str:
    """Return the address that a page prints; a thread drops what it prints after that."""
    lines = process.stdout or ()
    printed = []
    for line in lines:
        printed.append(line.strip())
        found = re.search(r'live page: (http://\S+)', line)
        if found:
            threading.Thread(target=list, args=(lines,), daemon=True).start()
            return found[1]
    raise GoalreachError(f'the page did not come up: {" ".join(printed)}')


def measure_load(run: ClockedRun, seconds: float, groups: Sequence[int]) -> RunLoad:
    """Measure a run for some time.

    Args:
        run: The run.
        seconds: Duration, s.
        groups: Process ids; each includes its descendants.
    """
    meters = [CpuMeter([pid, *descendants_of(pid)]) for pid in groups]
    began_s, clock_s = time.monotonic(), run.clock.now_s()
    time.sleep(seconds)
    return RunLoad(
        wall_s=time.monotonic() - began_s,
        clock_s=run.clock.now_s() - clock_s,
        used_s=tuple(meter.used_s for meter in meters),
        load=os.getloadavg()[0],
    )
