"""Graphs to be measured, ours and bare ones, and the probe that looks at them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import json
import os
from pathlib import Path
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
_BARE: Final = 'goalreach_lab.rigs.ros_bare'
_PROBE: Final = 'goalreach_lab.rigs.ros_probe'
_END_S: Final = 10.0


class Stand:
    """A ROS domain of its own, and what runs in it.

    Attributes:
        began_s: Time of the monotonic clock when the last graph was started.
    """

    def __init__(self, folder: Path) -> None:
        """Find a domain that no stack uses."""
        self._folder = folder
        self._domain = free_domains(1)[0]
        base = {**os.environ, 'ROS_DOMAIN_ID': str(self._domain)}
        self._environment = graph_environment(base, folder)
        self.began_s = 0.0

    @classmethod
    @contextmanager
    def ready(cls) -> Iterator[Stand]:
        """Yield a stand with a folder that goes when it does."""
        with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
            yield cls(Path(folder))

    @contextmanager
    def relay(self, kind: str, *, composed: bool = False) -> Iterator[None]:
        """Run the floor.

        Args:
            kind: 'lockstep' or 'realtime'.
            composed: Whether all nodes share one process.
        """
        groups: list[Sequence[str]] = [NODES] if composed else [(name,) for name in NODES]
        with self._together([(_RELAY, kind, *names) for names in groups]):
            yield

    @contextmanager
    def bare(self) -> Iterator[list[int]]:
        """Run four nodes that do nothing; yield their process ids."""
        with self._together([(_BARE, name) for name in NODES]) as pids:
            yield pids

    @contextmanager
    def _together(self, commands: Sequence[Sequence[str]]) -> Iterator[list[int]]:
        self.began_s = time.monotonic()
        processes = [self._start(*command) for command in commands]
        try:
            yield [process.pid for process in processes]
        finally:
            for process in processes:
                process.terminate()
            for process in processes:
                _end(process)

    @contextmanager
    def stack(self, *arguments: str) -> Iterator[Stack]:
        """Run `goalreach run` without end; yield it."""
        said: list[str] = []
        self.began_s = time.monotonic()
        stack = Stack(
            ['--no-dashboard', *arguments],
            domain=self._domain,
            log_directory=self._folder,
            tell=said.append,
        )
        try:
            yield stack
            if not stack.alive:
                raise GoalreachError(f'the stack ended: {said[-1] if said else "without a word"}')
        finally:
            stack.stop()

    @contextmanager
    def probe(self, kind: str, number: float = 0.0) -> Iterator[Probe]:
        """Look at what runs, or will run, in the domain; see `ros_probe`."""
        process = self._start(_PROBE, kind, str(number))
        try:
            yield Probe(process)
        finally:
            _end(process)

    def look(self, kind: str, number: float) -> dict[str, Any]:
        """Return what the probe sees of a graph that runs."""
        with self.probe(kind, number) as probe:
            return probe.read()

    def _start(self, module: str, *arguments: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, '-m', module, *arguments],
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # one that ends while it begins complains
            text=True,
        )


class Probe:
    """A probe that runs."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        """Keep the process."""
        self._process = process

    def read(self) -> dict[str, Any]:
        """Return its next line.

        Raises:
            GoalreachError: It ended without one.
        """
        line = self._process.stdout.readline() if self._process.stdout else ''
        if not line:
            raise GoalreachError('the graph under test did not come up')
        said: dict[str, Any] = json.loads(line)
        return said


def _end(process: subprocess.Popen[str]) -> None:
    wait_or_kill(process, _END_S)
    if process.stdout:
        process.stdout.close()
