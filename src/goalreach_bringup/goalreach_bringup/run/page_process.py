"""The live page of a run, in a process of its own."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
import os
from pathlib import Path
import re
import secrets
import sys
from typing import Final

from goalreach_bringup.dashboard.listening import TOKEN_VARIABLE
from goalreach_bringup.run.environment import graph_environment
from goalreach_bringup.run.node_process import NodeProcess, stop_all
from goalreach_msgs_py.errors import GoalreachError

__all__ = ['PageProcess', 'is_page_wanted']

_LINK: Final = re.compile(r'^live page: (http://\S+)$', re.MULTILINE)


def is_page_wanted(*, asked: bool | None, clock: str) -> bool:
    """Return whether a run shows its page.

    Unless the person said so, it does where the run is for a person: on a terminal, in real time,
    with the web library installed.

    Args:
        asked: What the person said, or None.
        clock: The run's clock.

    Raises:
        GoalreachError: It was asked for, and the web library is missing.
    """
    installed = find_spec('nicegui') is not None
    if asked and not installed:
        reason = 'needs nicegui: install the extra, pip install "goalreach[dashboard]"'
        raise GoalreachError(f'--dashboard {reason}')
    if asked is not None:
        return asked
    return installed and clock == 'realtime' and sys.stdout.isatty()


class PageProcess:
    """Starts `goalreach dashboard` for a run, tells its address, and ends it.

    Whoever has the address that is told may steer: it holds a token that is nowhere else.

    Args:
        arena: Name or file of the arena.
    """

    def __init__(self, arena: str) -> None:
        self._arena = arena
        self._token = secrets.token_urlsafe(16)
        self._process: NodeProcess | None = None
        self._told = False

    def start(
        self, directory: Path, *, tell: Callable[[str], None], warn: Callable[[str], None]
    ) -> None:
        """Start it; its log goes to the run's directory.

        Args:
            directory: The run's directory.
            tell: Called with the address once the page has told it.
            warn: Called with one line of trouble.
        """
        self._tell, self._warn = tell, warn
        command = [sys.executable, '-m', 'goalreach_bringup.cli', 'dashboard', '--controls']
        self._process = NodeProcess(
            'dashboard',
            [*command, '--arena', self._arena],
            environment={
                **graph_environment(os.environ, directory),
                TOKEN_VARIABLE: self._token,
            },
            log_path=directory / 'dashboard.log',
            tell=warn,
        )

    def look(self) -> None:
        """Tell the address once the page has one, or that it ended; the run goes on without it.

        The page finds its port itself: a port that is looked for here could be another's there.
        """
        if self._process is None or self._told:
            return
        if self._process.status is not None:
            self._told = True
            self._warn(f'dashboard: error: {self._process.last_words()}')
        elif found := _LINK.search(self._said()):
            self._told = True
            self._tell(f'live page: {found[1]}?token={self._token}')

    def _said(self) -> str:
        path = self._process.log_path if self._process is not None else None
        return path.read_text(encoding='utf-8') if path is not None and path.exists() else ''

    def stop(self) -> None:
        """End it."""
        if self._process is not None:
            stop_all([self._process])
