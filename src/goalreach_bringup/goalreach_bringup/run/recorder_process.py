"""The recorder of a run, in a process of its own."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
import signal
import sys
from typing import Final

from goalreach_bringup.run.environment import graph_environment
from goalreach_bringup.run.node_process import NodeProcess, stop_all
from goalreach_msgs_py.errors import GoalreachError

__all__ = ['RecorderProcess']

_DRAIN_S: Final = 30.0
"""Longest wait for a bag to be closed: it takes what is on its way and writes a summary."""


class RecorderProcess:
    """Starts `goalreach record` for a run and ends it.

    Args:
        path: The bag.
        storage: Its storage format.
        clock: The run's clock, 'lockstep' or 'realtime'.
        parameters: The run's parameter file, kept in the bag.
    """

    def __init__(self, path: Path, *, storage: str, clock: str, parameters: Path) -> None:
        self._path = path
        self._arguments = ['record', str(path), '--storage', storage, '--with-run', clock]
        self._arguments += ['--parameters', str(parameters)]
        self._process: NodeProcess | None = None
        self._ended = False
        self.failed = False

    def start(self, directory: Path, warn: Callable[[str], None]) -> None:
        """Start it; its log goes to the run's directory, its complaints to `warn`."""
        self._warn = warn
        self._process = NodeProcess(
            'recorder',
            [sys.executable, '-m', 'goalreach_bringup.cli', *self._arguments],
            environment=graph_environment(os.environ, directory),
            log_path=directory / 'recorder.log',
            tell=warn,
        )

    def require_started(self, *, began: bool) -> None:
        """Look after it: a run goes on without a recorder that ended, but does not begin so.

        Args:
            began: Whether the run has begun.

        Raises:
            GoalreachError: It ended before the run began.
        """
        if self._process is None or self._process.status is None or self._ended:
            return
        words = self._process.last_words() or 'no word in its log'
        if not began:
            raise GoalreachError(f'the recorder ended: {words}')
        self._ended = True
        self._warn(f'recorder: error: ended with status {self._process.status}: {words}')

    def stop(self) -> str:
        """End it and wait until the bag is closed; return its last word."""
        process = self._process
        if process is None:
            return ''
        process.signal(signal.SIGINT)
        if not process.wait(_DRAIN_S):
            stop_all([process])
        self.failed = process.status != 0
        words = process.last_words()
        if process.status is not None and process.status < 0:
            return f'the recorder was killed: goalreach record --repair {self._path}'
        return words
