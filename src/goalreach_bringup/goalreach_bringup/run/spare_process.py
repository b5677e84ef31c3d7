"""One process kept ready to become the next node that has to be started again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
import sys
from typing import Final

from goalreach_bringup.run.node_process import NodeProcess

__all__ = ['Spare']

_COMMAND: Final = (sys.executable, '-m', 'goalreach_bringup.run.ros_spare')
_CALM_S: Final = 2.0
"""It is made ready so long after the last start, whose work it must not slow down; chosen."""


class Spare:
    """Keeps one process ready; a second death while there is none is a usual start.

    Args:
        environment: Environment of the process.
        log_path: File that takes what it writes before it is a node.
        tell: Called with one line of trouble.
    """

    def __init__(
        self, *, environment: Mapping[str, str], log_path: Path, tell: Callable[[str], None]
    ) -> None:
        self._environment = environment
        self._log_path = log_path
        self._tell = tell
        self._process: NodeProcess | None = None
        self._due_s: float | None = None

    def wait(self, now_s: float) -> None:
        """Make none ready until there has been calm for a while."""
        self._due_s = now_s + _CALM_S

    def look(self, now_s: float) -> None:
        """Make one ready where it is due; one that has ended is not replaced before a restart."""
        if self._due_s is None or now_s < self._due_s:
            return
        self._due_s = None
        if self._process is None or self._process.status is not None:
            self._process = NodeProcess(
                'spare',
                _COMMAND,
                environment=self._environment,
                log_path=self._log_path,
                tell=self._tell,
                waits=True,
            )

    def take(self, name: str, arguments: Sequence[str], log_path: Path) -> NodeProcess | None:
        """Return the process, which is now a node; None where there is none.

        Args:
            name: The node.
            arguments: Of its command line.
            log_path: File that takes all it writes.
        """
        process, self._process = self._process, None
        if process is None or not process.become(name, arguments, log_path):
            return None
        return process

    def processes(self) -> list[NodeProcess]:
        """Return the process that is ready, to be ended with the others."""
        return [] if self._process is None else [self._process]
