"""A test rig for graphs: runs ours or a floor in a ROS domain, and measures it from outside."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import json
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any, Final

from goalreach_bringup.launch.environment import graph_environment
from goalreach_lab.rigs.stack import Stack, free_domains, wait_or_kill
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.topics import NODES

_RELAY: Final = 'goalreach_lab.rigs.ros_relay'
_BARE: Final = 'goalreach_lab.rigs.ros_bare_node'
_PROBE: Final = 'goalreach_lab.rigs.ros_probe'
_END_S: Final = 10.0


class GraphTestRig:
    """A ROS domain of its own, in which graphs are run and measured.

    Attributes:
        folder: Folder of its logs.
        domain: Its ROS domain.
        began_s: Time of the monotonic clock at which the last graph was started.
    """

    def __init__(self, folder: Path) -> None:
        """Find a domain that no stack uses."""
        self.folder = folder
        self.domain = free_domains(1)[0]
        base = {**os.environ, 'ROS_DOMAIN_ID': str(self.domain)}
        self._environment = graph_environment(base, folder)
        self.began_s = 0.0

    @classmethod
    @contextmanager
    def open(cls) -> Iterator['GraphTestRig']:
        """Yield a rig with a temporary folder for logs."""
        with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
            yield cls(Path(folder))

    @contextmanager
    def relay(self, kind: str, *, composed: bool = False) -> Iterator[list[int]]:
        """Run the floor: the same messages with callbacks that compute nothing.

        Args:
            kind: 'lockstep' or 'realtime'.
            composed: Whether all nodes share one process.

        Yields:
            The process ids.
        """
        groups: list[Sequence[str]] = [NODES] if composed else [(name,) for name in NODES]
        with self.run([('-m', _RELAY, kind, *names) for names in groups]) as pids:
            yield pids

    @contextmanager
    def bare_nodes(self) -> Iterator[list[int]]:
        """Run four nodes that only import rclpy; yield their process ids."""
        with self.run([('-m', _BARE, name) for name in NODES]) as pids:
            yield pids

    @contextmanager
    def run(self, commands: Sequence[Sequence[str]]) -> Iterator[list[int]]:
        """Run Python with each of some command lines; yield the process ids."""
        self.began_s = time.monotonic()
        processes = [self._start(*command) for command in commands]
        try:
            yield [process.pid for process in processes]
        finally:
            for process in processes:
                process.terminate()
            for process in processes:
                _close(process)

    @contextmanager
    def stack(self, *arguments: str) -> Iterator[Stack]:
        """Run `goalreach run` until the block ends.

        Raises:
            GoalreachError: It ended before.
        """
        self.began_s = time.monotonic()
        stack = Stack(
            ['--no-dashboard', *arguments], domain=self.domain, log_directory=self.folder
        )
        try:
            yield stack
            if not stack.alive:
                raise GoalreachError(f'the stack ended: {"; ".join(list(stack.lines)[-1:])}')
        finally:
            stack.stop()

    @contextmanager
    def probe(self, kind: str, number: float = 0.0, *, stock: bool = False) -> Iterator['Probe']:
        """Measure a graph that runs, or will run, in the domain; see `ros_probe`.

        Args:
            kind: What to measure.
            number: Duration, s, or count.
            stock: Whether the probe's DDS has its own defaults instead of our profile.
        """
        process = self._start('-m', _PROBE, kind, str(number), stock=stock)
        try:
            yield Probe(process)
        finally:
            _close(process)

    def measure(self, kind: str, number: float) -> dict[str, Any]:
        """Return what the probe measures of a graph that runs."""
        with self.probe(kind, number) as probe:
            return probe.read()

    def _start(self, *words: str, stock: bool = False) -> subprocess.Popen[str]:
        plain = {**os.environ, 'ROS_DOMAIN_ID': str(self.domain)}
        return subprocess.Popen(
            [sys.executable, *words],
            env=plain if stock else self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # ended while it starts, a process prints a traceback
            text=True,
        )


class Probe:
    """A running probe process.

    Args:
        process: The process.
    """

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def read(self) -> dict[str, Any]:
        """Return the next object that it prints.

        Raises:
            GoalreachError: It ended without printing one.
        """
        for line in self._process.stdout or ():
            if line.startswith('{'):  # Fast DDS prints its complaints there, too
                values: dict[str, Any] = json.loads(line)
                return values
        raise GoalreachError('the graph under test did not come up')


def _close(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGCONT)  # of one that stopped itself
    wait_or_kill(process, _END_S)
    if process.stdout:
        process.stdout.close()
