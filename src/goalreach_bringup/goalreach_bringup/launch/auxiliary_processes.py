"""Auxiliary processes of a run: the live page and the recorder."""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
import logging
from pathlib import Path
import re
import secrets
import signal
import sys
from typing import Final

from goalreach_bringup.launch.child_process import ChildProcess, stop_all
from goalreach_dashboard import TOKEN_VARIABLE
from goalreach_msgs_py.errors import GoalreachError

_LOG: Final = logging.getLogger(__name__)
_COMMAND_LINE: Final = 'goalreach_bringup.cli'
_PAGE_LINE: Final = re.compile(r'^live page: (http://\S+)$')


def require_page() -> None:
    """Check that the web library of the live page is installed.

    Raises:
        GoalreachError: It is not. A script of a clone installs it into the clone's `.venv`.
    """
    if find_spec('nicegui') is None:
        script = Path(sys.prefix).parent / 'scripts' / 'dashboard.py'
        python = sys.executable
        pip = f'{python} -m pip install' if find_spec('pip') else f'uv pip install -p {python}'
        cure = f'python3 {script}' if script.is_file() else f'{pip} nicegui'
        raise GoalreachError(f'the live page needs nicegui: `{cure}` installs it')


def is_page_wanted(*, requested: bool | None, clock: str) -> bool:
    """Return whether a run shows its page.

    Unless an option says so, it does where the run is for a person: on a terminal, in real time,
    with the web library installed.

    Args:
        requested: Value of the option, or None.
        clock: The run's clock.

    Raises:
        GoalreachError: It was requested, and the web library is missing.
    """
    if requested:
        require_page()
    if requested is not None:
        return requested
    installed = find_spec('nicegui') is not None
    return installed and clock == 'realtime' and sys.stdout.isatty()


class PageProcess(ChildProcess):
    """Runs `goalreach dashboard` for a run and reports its URL.

    Anyone with the reported URL may steer: it holds a token that is nowhere else.

    Args:
        arena: Name or file of the arena.
        directory: Directory of the run, for its log.
        environment: Environment of the graph.
    """

    def __init__(self, arena: str, directory: Path, environment: Mapping[str, str]) -> None:
        self._token = secrets.token_urlsafe(16)
        self._reported = False
        super().__init__(
            'dashboard',
            _COMMAND_LINE,
            ['dashboard', '--controls', '--arena', arena],
            environment={**environment, TOKEN_VARIABLE: self._token},
            log_path=directory / 'dashboard.log',
        )

    def poll(self) -> None:
        """Report its URL once it has one, or that it ended; the run continues without it."""
        if self._reported:
            return
        for line in self.read_log():
            if found := _PAGE_LINE.match(line):
                self._reported = True
                _LOG.info('live page: %s?token=%s', found[1], self._token)
        if self.exit_status is not None:
            self._reported = True
            _LOG.error('dashboard: error: %s', self.last_log_line())


_DRAIN_S: Final = 30.0
"""Longest wait for a bag to be closed: the recorder flushes messages and writes a summary."""


class RecorderProcess(ChildProcess):
    """Runs `goalreach record` for a run.

    Args:
        bag: The bag.
        arguments: Further options of the command.
        directory: Directory of the run, for its log.
        environment: Environment of the graph.

    Attributes:
        failed: Whether it ended with an error.
    """

    def __init__(
        self,
        bag: Path,
        arguments: Sequence[str],
        directory: Path,
        environment: Mapping[str, str],
    ) -> None:
        self.failed = False
        self._bag = bag
        self._reported = False
        super().__init__(
            'record',
            _COMMAND_LINE,
            ['record', str(bag), *arguments],
            environment=environment,
            log_path=directory / 'recorder.log',
        )

    def poll(self, *, began: bool) -> None:
        """Check that it runs: a run continues without a recorder, but does not start without.

        Args:
            began: Whether the run has begun.

        Raises:
            GoalreachError: It ended before the run began.
        """
        if self._reported:
            return
        self.read_log()
        if self.exit_status is None:
            return
        summary = self.exit_summary()
        if not began:
            raise GoalreachError(f'the recorder {summary}')
        self._reported = True
        _LOG.error('recorder: error: %s', summary)

    def stop(self) -> str:
        """End it and wait until the bag is closed; return its last log line."""
        self.signal(signal.SIGINT)
        if not self.wait(_DRAIN_S):
            stop_all([self])
        status = self.exit_status
        self.failed = status != 0
        if status is not None and status < 0:
            return f'the recorder was killed: goalreach record --repair {self._bag}'
        return self.last_log_line()
