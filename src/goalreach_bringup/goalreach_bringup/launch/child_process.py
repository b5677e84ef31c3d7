"""One node of the graph as a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
import json
import os
from pathlib import Path
import re
import secrets
import signal
import subprocess
import sys
import threading
import time
from typing import IO, Final

from goalreach_bringup.launch.environment import graph_environment
from goalreach_dashboard.address import TOKEN_VARIABLE
from goalreach_msgs_py.errors import GoalreachError

_LOUD = re.compile(r'^\[(WARN|ERROR|FATAL)\] \[[^\]]*\] \[([^\]]*)\]: (.*)$')
_GRACE_S = 3.0
_KILL_S = 1.0


class NodeProcess:
    """A child process whose log goes to a file and whose warnings go to the screen.

    Args:
        name: The node's name.
        command: Program and arguments.
        environment: Environment of the process.
        log_path: File that takes all it writes.
        tell: Called with one line for the screen, from a thread of this object.
        waits: Whether it waits for `become` before it does anything.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        *,
        environment: Mapping[str, str],
        log_path: Path,
        tell: Callable[[str], None],
        waits: bool = False,
    ) -> None:
        """Start the process in a session of its own: a Ctrl-C is for the launcher to hand on."""
        self.name = name
        self.log_path = log_path
        self.killed = False
        self._tell = tell
        self._last_line = ''
        self._process = subprocess.Popen(
            command,
            env=dict(environment),
            stdin=subprocess.PIPE if waits else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors='replace',
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read, name=f'log of {name}', daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def status(self) -> int | None:
        """Exit status, or None while it runs."""
        return self._process.poll()

    def last_words(self) -> str:
        """Return the last line that the process wrote, once it has ended."""
        self._reader.join(timeout=_KILL_S)
        return self._last_line

    def obituary(self) -> str:
        """Return how the process ended, in a few words."""
        status = self.status
        if status is not None and status < 0:
            return f'was ended by {signal.Signals(-status).name}'
        return f'ended with status {status}: {self.last_words() or "nothing in its log"}'

    def signal(self, number: signal.Signals) -> None:
        """Send a signal, if it still runs."""
        if self.status is None:
            self._process.send_signal(number)

    def become(self, name: str, arguments: Sequence[str], log_path: Path) -> bool:
        """Tell a process that waits which node it is; return whether it heard.

        Args:
            name: The node.
            arguments: Of its command line.
            log_path: File that takes all it writes from now on.
        """
        self.name, self.log_path = name, log_path
        stream: IO[str] | None = self._process.stdin
        try:
            if stream is not None:
                stream.write(json.dumps([name, *arguments]) + '\n')
                stream.close()
        except OSError:
            return False
        return self.status is None

    def wait(self, timeout_s: float) -> bool:
        """Return whether the process ended within the time."""
        try:
            self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return False
        return True

    def _read(self) -> None:
        stream: IO[str] | None = self._process.stdout
        if stream is None:
            return
        for line in stream:
            with self.log_path.open('a', encoding='utf-8') as log:
                log.write(line)
                text = line.rstrip()
                self._last_line = text or self._last_line
                loud = _LOUD.match(text)
                if loud:
                    self._tell(f'{loud[2]}: {loud[1].lower()}: {loud[3]}')


def stop_all(processes: Sequence[NodeProcess]) -> list[str]:
    """End processes: SIGINT, after a grace SIGTERM, at last SIGKILL.

    Returns:
        Names of those that had to be killed.
    """
    for number, grace_s in ((signal.SIGINT, _GRACE_S), (signal.SIGTERM, _KILL_S)):
        for process in processes:
            process.signal(number)
        deadline_s = time.monotonic() + grace_s
        for process in processes:
            process.wait(max(0.0, deadline_s - time.monotonic()))
    killed = [process for process in processes if process.status is None]
    for process in killed:
        process.signal(signal.SIGKILL)
        process.wait(_KILL_S)
    return [process.name for process in killed]


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


_COMMAND: Final = (sys.executable, '-m', 'goalreach_bringup.launch.ros.spare')
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
