"""A stack under test: `goalreach run` in a process of its own, and the processes of its nodes."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import fcntl
import os
from pathlib import Path
import signal
import subprocess
import sys
import threading
import time
from typing import Any, Final

from goalreach_bringup.launch.environment import FIRST_DOMAIN, open_domain_file
from goalreach_lab.rigs.proc_file import find_child
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.topics import NODES

_END_S: Final = 20.0


def goalreach_command(*words: str) -> list[str]:
    """Return the command line of one of our commands."""
    return [sys.executable, '-m', 'goalreach_bringup.cli', *words]


def wait_or_kill(process: subprocess.Popen[Any], limit_s: float) -> bool:
    """Wait for the end of a process that was asked to end; return whether it did by itself."""
    try:
        process.wait(limit_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return False
    return True


class Stack:
    """A running stack; what it prints is handed on line by line.

    Args:
        arguments: Of `goalreach run`.
        domain: Its ROS domain.
        log_directory: Where it keeps its logs.
        tell: Called with each line, from a thread of this object.
    """

    def __init__(
        self,
        arguments: list[str],
        *,
        domain: int,
        log_directory: Path,
        tell: Callable[[str], None],
    ) -> None:
        """Start it."""
        self.environment = {
            **os.environ,
            'ROS_DOMAIN_ID': str(domain),
            'ROS_LOG_DIR': str(log_directory),
            'NO_COLOR': '1',
        }
        self._tell = tell
        self._process = subprocess.Popen(
            goalreach_command('run', *arguments),
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self._tell(line.rstrip())

    @property
    def pid(self) -> int:
        """Process id of the launcher."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the launcher runs."""
        return self._process.poll() is None

    def node_pid(self, node: str) -> int:
        """Return the process id of a node.

        Raises:
            GoalreachError: It does not run now.
        """
        pid = self.find_node(node)
        if pid is None:
            raise GoalreachError(f'{node} does not run')
        return pid

    def find_node(self, node: str) -> int | None:
        """Return the process id of a node, or None."""
        return find_child(self.pid, node)

    def send(self, node: str, number: signal.Signals) -> None:
        """Send a signal to a node, if it runs."""
        pid = self.find_node(node)
        if pid is not None:
            os.kill(pid, number)

    def stop(self, number: signal.Signals = signal.SIGINT) -> bool:
        """End it; return whether it ended by itself."""
        for node in NODES:
            self.send(node, signal.SIGCONT)
        if self.alive:
            self._process.send_signal(number)
        if not wait_or_kill(self._process, _END_S):
            return False
        self._reader.join(1.0)
        return True

    def wait_for_nodes(self, limit_s: float = 20.0) -> None:
        """Wait until every node has its process.

        Raises:
            GoalreachError: One has not, in time.
        """
        deadline_s = time.monotonic() + limit_s
        while any(self.find_node(node) is None for node in NODES):
            if time.monotonic() > deadline_s or not self.alive:
                raise GoalreachError('the stack did not come up')
            time.sleep(0.05)


def free_domains(count: int) -> list[int]:
    """Return domains in which no stack of this person runs now, from ROS_DOMAIN_ID on, else 10."""
    found: list[int] = []
    given = os.environ.get('ROS_DOMAIN_ID', '')
    domain = int(given) if given.isdecimal() else FIRST_DOMAIN
    while len(found) < count:
        with open_domain_file(str(domain)) as stream, contextlib.suppress(BlockingIOError):
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            found.append(domain)
        domain += 1
    return found
