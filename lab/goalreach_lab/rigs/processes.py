"""Processes of a stack: who belongs to it, what they use and hold."""

from collections.abc import Sequence
import contextlib
from dataclasses import dataclass
import time

import psutil

from goalreach_msgs_py.topics import NODES

_MB = 1e6
_NAME_LENGTH = 15
"""Linux keeps so many letters of the name of a process."""

_COMMANDS = ('record', 'dashboard')


@dataclass(frozen=True, kw_only=True)
class Holdings:
    """Resources that a process holds.

    Attributes:
        name: Node or command that the process runs.
        memory_mb: Resident anonymous memory, without shared memory and mapped files, MB.
        threads: Number of threads.
        handles: Number of open files, sockets and pipes.
        shared_files: Number of files in shared memory that it has mapped.
    """

    name: str
    memory_mb: float
    threads: int
    handles: int
    shared_files: int


@dataclass(frozen=True, kw_only=True)
class Sample:
    """Holdings of one process at one moment.

    Attributes:
        pid: Process id.
        clock_s: Simulated time.
        holdings: What it held.
        present_files: Files of Fast DDS in shared memory, of all processes of the machine.
    """

    pid: int
    clock_s: float
    holdings: Holdings
    present_files: int = 0


def descendants_of(pid: int) -> list[int]:
    """Return the process ids of the children of a process, of their children, and so on."""
    with contextlib.suppress(psutil.NoSuchProcess):
        return [child.pid for child in psutil.Process(pid).children(recursive=True)]
    return []


def find_descendant(pid: int, node: str) -> int | None:
    """Return the descendant of a launcher that runs a node, or None where none runs it now."""
    for child in descendants_of(pid):
        with contextlib.suppress(psutil.Error):
            if psutil.Process(child).name()[:_NAME_LENGTH] == node[:_NAME_LENGTH]:
                return child
    return None


def processes_with(variable: str, value: str) -> list[int]:
    """Return the processes that were started with an environment variable at a value."""
    found = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            if process.environ().get(variable) == value:
                found.append(process.pid)
    return found


def cpu_time_s(pid: int) -> float:
    """Return the processor time that a process has used, s; 0 where it has ended."""
    with contextlib.suppress(psutil.NoSuchProcess):
        times = psutil.Process(pid).cpu_times()
        return float(times.user + times.system)
    return 0.0


class CpuMeter:
    """Measures the processor time of processes from its construction on.

    Args:
        pids: Process ids.
    """

    def __init__(self, pids: Sequence[int]) -> None:
        self._pids = pids
        self._began_s, self._before_s = time.monotonic(), sum(map(cpu_time_s, pids))

    @property
    def used_s(self) -> float:
        """Processor time used so far, s."""
        return sum(map(cpu_time_s, self._pids)) - self._before_s

    @property
    def cores(self) -> float:
        """Processor time used per time passed."""
        return self.used_s / (time.monotonic() - self._began_s)


def proportional_mb(pids: Sequence[int]) -> float:
    """Return the proportional set size of processes, MB; shared pages count in equal parts."""
    total = 0.0
    for pid in pids:
        with contextlib.suppress(psutil.NoSuchProcess):
            total += psutil.Process(pid).memory_full_info().pss / _MB
    return total


def holdings_of(pid: int) -> Holdings | None:
    """Return what a process holds, or None where it has ended."""
    try:
        process = psutil.Process(pid)
        with process.oneshot():
            memory = process.memory_info()
            mapped = {one.path for one in process.memory_maps()}
            return Holdings(
                name=_role(process.name(), process.cmdline()),
                memory_mb=(memory.rss - memory.shared) / _MB,
                threads=process.num_threads(),
                handles=process.num_fds(),
                shared_files=sum(path.startswith('/dev/shm/') for path in mapped),  # noqa: S108
            )
    except psutil.Error:
        return None


def _role(name: str, words: Sequence[str]) -> str:
    """Return the node or the command that a process runs, or else what part of a run it is."""
    for node in (*NODES, 'composed', *_COMMANDS):
        if name[:_NAME_LENGTH] == node[:_NAME_LENGTH]:
            return node
    for helper in ('forkserver', 'resource_tracker'):
        if any(f'multiprocessing.{helper}' in word for word in words):
            return helper
    return next((word for word in words if word in _COMMANDS), 'launcher')
