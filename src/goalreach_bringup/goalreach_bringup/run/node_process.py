"""One node of the graph as a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import json
from pathlib import Path
import re
import signal
import subprocess
import threading
import time
from typing import IO

__all__ = ['NodeProcess', 'stop_all']

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
