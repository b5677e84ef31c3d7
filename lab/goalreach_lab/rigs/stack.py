"""A stack under test: `goalreach run` as a child process, and the processes of its nodes."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
import itertools
import os
from pathlib import Path
import signal
import subprocess
import sys
import threading
import time
from typing import IO, Any, Final

from goalreach_bringup.launch.environment import FIRST_DOMAIN, unused_domains
from goalreach_lab.rigs.processes import find_descendant
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.topics import NODES

_END_S: Final = 20.0
_KEPT_LINES: Final = 200


def start_command(
    *words: str, environment: Mapping[str, str], output: int | IO[str] = subprocess.PIPE
) -> subprocess.Popen[str]:
    """Start a command of goalreach as a child process that prints to one stream.

    Args:
        words: The command and its arguments.
        environment: Its environment.
        output: Stream of what it prints.
    """
    return subprocess.Popen(
        [sys.executable, '-m', 'goalreach_bringup.cli', *words],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.STDOUT,
        text=True,
    )


def wait_or_kill(process: subprocess.Popen[Any], limit_s: float) -> bool:
    """Wait until a process ends, and kill it after the limit; return whether it ended itself."""
    try:
        process.wait(limit_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return False
    return True


class Stack:
    """A running stack.

    Args:
        arguments: Of `goalreach run`.
        domain: Its ROS domain.
        log_directory: Directory of its logs.
        on_line: Called with each line that it prints, from a thread of this object.

    Attributes:
        lines: The last lines that it printed.
        environment: Environment of its processes; further commands may join the graph with it.
    """

    def __init__(
        self,
        arguments: Sequence[str],
        *,
        domain: int,
        log_directory: Path,
        on_line: Callable[[str], object] | None = None,
    ) -> None:
        """Start it."""
        self.environment = {
            **os.environ,
            'ROS_DOMAIN_ID': str(domain),
            'ROS_LOG_DIR': str(log_directory),
            'NO_COLOR': '1',
        }
        self.lines: deque[str] = deque(maxlen=_KEPT_LINES)
        self._on_line = on_line
        self._process = start_command('run', *arguments, environment=self.environment)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self.lines.append(line.rstrip())
            if self._on_line is not None:
                self._on_line(line.rstrip())

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
            GoalreachError: No process runs it now.
        """
        pid = self.find_node(node)
        if pid is None:
            raise GoalreachError(f'{node} does not run')
        return pid

    def find_node(self, node: str) -> int | None:
        """Return the process id of a node, or None."""
        return find_descendant(self.pid, node)

    def send(self, node: str, number: signal.Signals) -> None:
        """Send a signal to a node, if it runs."""
        pid = self.find_node(node)
        if pid is not None:
            os.kill(pid, number)

    def stop(self) -> None:
        """Interrupt it and wait until it has ended."""
        for node in NODES:
            self.send(node, signal.SIGCONT)
        if self.alive:
            self._process.send_signal(signal.SIGINT)
        wait_or_kill(self._process, _END_S)
        self._reader.join(1.0)

    def wait_for_nodes(self, limit_s: float = 20.0) -> None:
        """Wait until every node has its process.

        Raises:
            GoalreachError: A node has no process at the limit, or the launcher has ended.
        """
        deadline_s = time.monotonic() + limit_s
        while any(self.find_node(node) is None for node in NODES):
            if time.monotonic() > deadline_s or not self.alive:
                raise GoalreachError('the stack did not come up')
            time.sleep(0.05)


def free_domains(count: int) -> list[int]:
    """Return domains that nobody on this machine uses, from ROS_DOMAIN_ID on, else from 10 on."""
    given = os.environ.get('ROS_DOMAIN_ID', '')
    first = int(given) if given.isdecimal() else FIRST_DOMAIN
    return list(itertools.islice(unused_domains(first), count))
