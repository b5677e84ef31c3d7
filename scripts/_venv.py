"""The private environment ``.venv`` in the repository's root: its state, and how it is made."""

from collections.abc import Iterator
import contextlib
import enum
import fcntl
import hashlib
import os
from pathlib import Path
import re
import shutil
import tempfile
import time

from _base_python import base_python
from _install import (
    InterruptedSetupError,
    Progress,
    SetupError,
    follow,
    interruptible,
    say,
    uninterrupted,
)

LOCK_NAME = 'requirements.lock'
MARKER_NAME = 'goalreach-setup'  # inside .venv: says that we made it, and from which lock
UNFINISHED = 'unfinished\n'
BUILD_TOOLS = ('setuptools', 'wheel')  # what building the root needs; one dependency is a source

PIP_OPTIONS = (
    '--no-input',
    '--progress-bar=off',
    '--disable-pip-version-check',
    '--no-deps',  # the lock names every package
    '--no-build-isolation',  # build with the locked tools
    '--no-compile',  # halves the set-up; modules are compiled when they are first imported
)
# Settings of the caller's Python and pip that would lead an installation elsewhere.
FOREIGN_SETTINGS = (
    '_ROS_WHEELS_BOOTSTRAP_COMPLETE',
    'LD_LIBRARY_PATH',
    'PIP_PREFIX',
    'PIP_ROOT',
    'PIP_TARGET',
    'PIP_USER',
    'PYTHONHOME',
    'PYTHONPATH',
)


class State(enum.Enum):
    """What is found where ``.venv`` belongs."""

    ABSENT = enum.auto()
    FOREIGN = enum.auto()  # not made here: never touched
    INCOMPLETE = enum.auto()  # made here; interrupted, moved, or of another lock
    READY = enum.auto()


class Venv:
    """``.venv`` in a repository's root.

    Args:
        root: Root of the repository.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._marker = root / '.venv' / MARKER_NAME
        self._discarded = root / '.venv.removing'
        self.path = root / '.venv'
        self.python = self.path / 'bin' / 'python'

    def state(self) -> State:
        """Tell what is there now."""
        if not os.path.lexists(self.path):
            return State.ABSENT
        if not self._marker.is_file():
            empty = self.path.is_dir() and not any(self.path.iterdir())
            return State.INCOMPLETE if empty else State.FOREIGN
        if self._marker.read_text() == self._fingerprint() and self.python.exists():
            return State.READY
        return State.INCOMPLETE

    def ensure(self) -> None:
        """Make the environment, unless it is there; wait where another process makes it.

        Raises:
            SetupError: Where it cannot be made; nothing of it is left then.
        """
        if self.state() is State.READY:
            return
        with _exclusive(self._root) as lock:
            if self.state() is State.READY:
                return
            self._make(lock)

    def _make(self, lock: int) -> None:
        base = base_python()
        progress = Progress(steps=5)
        started_s = time.monotonic()
        try:
            with interruptible():
                self._discard()
                self.path.mkdir()
                self._marker.write_text(UNFINISHED)
                say(f'setting up {self.path}: once, about a minute and 800 MB')
                self._install(base, lock, progress)
                self._marker.write_text(self._fingerprint())
        except (SetupError, OSError) as error:
            with uninterrupted():
                self._discard()
            advice = 'Start the same command again to retry.'
            if not isinstance(error, InterruptedSetupError):
                advice = f'It needs the package index and 800 MB of disk. {advice}'
            message = (
                f'the set-up failed ({progress.running}): {error}\n'
                f'{self.path} was removed again. {advice}'
            )
            raise SetupError(message, getattr(error, 'status', 1)) from None
        say(f'ready after {time.monotonic() - started_s:.0f} s')

    def _install(self, base: str, lock: int, progress: Progress) -> None:
        environment = {k: v for k, v in os.environ.items() if k not in FOREIGN_SETTINGS}
        pip = [str(self.python), '-m', 'pip', 'install', *PIP_OPTIONS]
        requirements = self._root / LOCK_NAME
        with progress.step('virtual environment'):
            follow([base, '-m', 'venv', str(self.path)], environment, lock)
        with progress.step('build tools'), tempfile.NamedTemporaryFile('w', suffix='.txt') as part:
            part.write(build_tools(requirements.read_text()))
            part.flush()
            follow([*pip, '--require-hashes', '-r', part.name], environment, lock)
        with progress.step('locked packages'):
            counter = PackageCounter(requirements.read_text(), progress)
            command = [*pip, '--require-hashes', '-r', str(requirements)]
            follow(command, environment, lock, counter.read)
        with progress.step('goalreach'):
            follow([*pip, '-e', str(self._root)], environment, lock)
        with progress.step('check'):
            check = 'import goalreach_bringup, rclpy'
            follow([str(self.python), '-I', '-c', check], environment, lock)

    def _fingerprint(self) -> str:
        """Return what the marker holds once all is done.

        It changes with the lock and with the place: scripts in an environment hold its path.
        """
        content = (self._root / LOCK_NAME).read_bytes() + os.fsencode(self._root)
        return hashlib.sha256(content).hexdigest() + '\n'

    def _discard(self) -> None:
        """Remove the environment; killed half-way, it is not mistaken for a foreign one."""
        shutil.rmtree(self._discarded, ignore_errors=True)
        if self.path.exists():
            self.path.rename(self._discarded)
            shutil.rmtree(self._discarded, ignore_errors=True)


def build_tools(lock: str) -> str:
    r"""Return the part of a lock that must be installed first, hashes included.

    Example:
        >>> build_tools('numpy==2.0 --hash=a\nwheel==0.4 --hash=b\n')
        'wheel==0.4 --hash=b\n'
    """
    entries = re.findall(r'^[a-zA-Z0-9][^\n]*\n(?:[ \t]+[^\n]*\n)*', lock, flags=re.MULTILINE)
    return ''.join(entry for entry in entries if entry.split('==')[0] in BUILD_TOOLS)


class PackageCounter:
    """Tells how far an installation is, from what pip prints.

    Args:
        lock: Text of the lock that is installed.
        progress: Where it tells.
    """

    def __init__(self, lock: str, progress: Progress) -> None:
        self._progress = progress
        self._total = len(re.findall(r'^[a-zA-Z0-9][^\n]*==', lock, flags=re.MULTILINE))
        self._done = 0

    def read(self, line: str) -> None:
        """Take one line of pip's output."""
        word, _, rest = line.strip().partition(' ')
        if word == 'Ignoring':
            self._total -= 1
        elif word == 'Collecting':
            self._done += 1
            name = rest.split('==')[0]
            self._progress.detail(f'{self._done} of {self._total}, {name}')
        elif line.startswith('Installing collected'):
            self._progress.detail(f'unpacking {self._total}')


@contextlib.contextmanager
def _exclusive(root: Path) -> Iterator[int]:
    """Hold the only right to change the environment; the folder itself is the lock."""
    descriptor = os.open(root, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say('another start is setting up .venv: waiting for it')
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield descriptor
    finally:
        os.close(descriptor)
