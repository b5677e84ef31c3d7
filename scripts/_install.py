"""Runs the steps of a set-up as child processes, with progress and clean interruption."""

from collections import deque
from collections.abc import Callable, Iterator
import contextlib
import os
import signal
import subprocess
import sys
import time
from types import FrameType
from typing import NoReturn, TextIO

TAIL_LINES = 12  # of a failed step's output; pip says why in its last ones
KILL_AFTER_S = 5.0  # a child that does not end when asked


class SetupError(Exception):
    """The environment cannot be used or made.

    Attributes:
        status: Exit status for the process.
    """

    def __init__(self, message: str, status: int = 1) -> None:
        super().__init__(message)
        self.status = status


class InterruptedSetupError(SetupError):
    """A signal ended the set-up."""

    def __init__(self, signal_number: int) -> None:
        name = signal.Signals(signal_number).name
        super().__init__(f'interrupted by {name}', status=128 + signal_number)


def say(message: str) -> None:
    """Write one line for the user to stderr: stdout belongs to the command."""
    print(f'goalreach: {message}', file=sys.stderr, flush=True)


class Progress:
    """One line per step; on a terminal the line of the running step is rewritten in place.

    Args:
        steps: Number of steps to come.
        stream: Where the lines go.

    Attributes:
        running: Name of the step that runs.
    """

    def __init__(self, steps: int, stream: TextIO = sys.stderr) -> None:
        self._steps = steps
        self._stream = stream
        self._live = stream.isatty()
        self._number = 0
        self._text = ''
        self.running = 'before the first step'
        self._started_s = 0.0

    @contextlib.contextmanager
    def step(self, text: str) -> Iterator[None]:
        """Show a step while it runs, and its seconds once it succeeded."""
        self._number += 1
        self.running = text
        self._text = f'  {self._number}/{self._steps} {text}'
        self._started_s = time.monotonic()
        self._write(self._text, end='' if self._live else '\n')
        try:
            yield
        except BaseException:
            if self._live:
                self._write('', end='\n')
            raise
        if self._live:
            seconds = time.monotonic() - self._started_s
            self._write(f'\r\033[K{self._text}: {seconds:.0f} s', end='\n')

    def detail(self, text: str) -> None:
        """Show how far the running step is, where the line can be rewritten."""
        if self._live:
            self._write(f'\r\033[K{self._text}: {text}'[:79], end='')

    def _write(self, text: str, end: str) -> None:
        print(text, end=end, file=self._stream, flush=True)


def follow(
    command: list[str],
    environment: dict[str, str],
    keep_open: int,
    on_line: Callable[[str], object] = str,
) -> None:
    """Run a command to its end.

    The command gets its own session, so that Ctrl-C reaches this process alone, which ends the
    command and its children when it is interrupted.

    Args:
        command: Program and arguments.
        environment: Environment variables of the child.
        keep_open: File descriptor of the lock, held until the child has ended too.
        on_line: Called with each line of the child's stdout and stderr.

    Raises:
        SetupError: With the last lines of the output, when the command fails.
    """
    tail: deque[str] = deque(maxlen=TAIL_LINES)
    child = subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors='replace',
        start_new_session=True,
        pass_fds=[keep_open],
    )
    try:
        for line in child.stdout or ():
            tail.append(line.rstrip())
            on_line(tail[-1])
        child.wait()
    except BaseException:
        with uninterrupted():
            _end(child)
        raise
    finally:
        if child.stdout:
            child.stdout.close()
    if child.returncode:
        lines = '\n'.join(f'    {line}' for line in tail)
        message = f'exit status {child.returncode}\n{lines}'
        raise SetupError(message)


def _end(child: 'subprocess.Popen[str]') -> None:
    for number in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child.pid, number)
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.wait(timeout=KILL_AFTER_S)
            return


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Turn SIGINT, SIGTERM and SIGHUP into InterruptedSetupError inside the block."""

    def interrupt(number: int, _frame: FrameType | None) -> NoReturn:
        raise InterruptedSetupError(number)

    with _handling(interrupt):
        yield


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Ignore the same signals inside the block, which tidies up."""
    with _handling(signal.SIG_IGN):
        yield


@contextlib.contextmanager
def _handling(
    handler: Callable[[int, FrameType | None], object] | signal.Handlers,
) -> Iterator[None]:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, handler) for number in numbers]
    try:
        yield
    finally:
        for number, old in zip(numbers, before, strict=True):
            signal.signal(number, old)
