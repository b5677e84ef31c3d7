"""The private environment `.venv` in the repository's root: its state, and how it is made."""

from collections.abc import Callable, Iterator
import contextlib
import enum
import fcntl
import hashlib
import os
from pathlib import Path
import platform
import re
import shutil
import signal
import subprocess
import sys
import time
from types import FrameType

OLDEST_GLIBC = (2, 28)  # of the ROS 2 wheels
SUPPORTED_MINORS = (13, 12, 11, 10)  # of Python 3: those the ROS 2 Jazzy wheels are built for
# Each lock holds the one before.
LOCKS = {
    'run': 'requirements.lock',
    'page': 'requirements-page.lock',
    'dev': 'requirements-dev.lock',
}
SIZES = {'run': '600 MB', 'page': '600 MB', 'dev': '1.3 GB'}
MARKER_NAME = 'goalreach-setup'  # inside .venv: made here, and the locks that are installed
BUILD_TOOLS = ('setuptools', 'uv', 'wheel')  # one dependency is a source distribution
PIP_OPTIONS = ('--no-input', '--disable-pip-version-check', '--no-compile', '--no-cache-dir')
UV_OPTIONS = ('--system-certs', '--no-cache', '--index-strategy', 'unsafe-best-match')  # as pip
# Variables by which uv follows the settings of pip.
UV_VARIABLES = {
    'cert': 'SSL_CERT_FILE',
    'extra-index-url': 'UV_EXTRA_INDEX_URL',
    'find-links': 'UV_FIND_LINKS',
    'index-url': 'UV_DEFAULT_INDEX',
    'proxy': 'ALL_PROXY',
}
CHECK = 'import goalreach_bringup, rclpy'
STDERR = 2
LOCKED = ('--no-deps', '--no-build-isolation', '--require-hashes', '-r')
# They name another environment's libraries, and would hide those of the one that is started.
FOREIGN_VARIABLES = (
    '_ROS_WHEELS_BOOTSTRAP_COMPLETE',
    'AMENT_PREFIX_PATH',
    'LD_LIBRARY_PATH',
    'PYTHONPATH',
)
# With them, the settings of the caller's Python and pip that would lead an installation elsewhere.
FOREIGN_SETTINGS = (
    *FOREIGN_VARIABLES,
    'PIP_PREFIX',
    'PIP_ROOT',
    'PIP_TARGET',
    'PIP_USER',
    'PYTHONHOME',
)


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


class State(enum.Enum):
    """State of the folder `.venv`."""

    ABSENT = enum.auto()
    FOREIGN = enum.auto()  # not made by these scripts: never touched
    INCOMPLETE = enum.auto()  # interrupted, moved, made from another lock, or lacks a group
    READY = enum.auto()


def say(message: str) -> None:
    """Write one line for the user to stderr: stdout belongs to the command."""
    with contextlib.suppress(OSError):  # nobody reads it
        os.write(STDERR, os.fsencode(f'goalreach: {message}\n'))


class Venv:
    """`.venv` in a repository's root.

    Args:
        root: Root of the repository.
        group: A key of `LOCKS`: 'run' for what running needs, 'page' for the live page too,
            'dev' for everything.
    """

    def __init__(self, root: Path, group: str = 'run') -> None:
        self._root = root
        self._group = group
        self._marker = root / '.venv' / MARKER_NAME
        self._discarded = root / '.venv.removing'
        self.path = root / '.venv'
        self.python = self.path / 'bin' / 'python'
        self._lock = -1
        self._signals: list[int] = []
        self._uv_variables: dict[str, str] | None = None

    def state(self) -> State:
        """Return the present state."""
        if not os.path.lexists(self.path):
            return State.ABSENT
        if not self._marker.is_file():
            empty = self.path.is_dir() and not any(self.path.iterdir())
            return State.INCOMPLETE if empty else State.FOREIGN
        return State.READY if self._holds(self._group) else State.INCOMPLETE

    def ensure(self) -> None:
        """Make or complete the environment where needed; wait while another process makes it.

        Raises:
            SetupError: It cannot be made. A half-made environment is removed; one that served
                other commands before stays.
        """
        if self.state() is not State.READY:
            if not os.access(self._root, os.W_OK):
                raise SetupError(f'{self._root}: cannot make .venv here, the folder is read-only')
            with _exclusive(self._root) as self._lock:
                if self.state() is not State.READY:
                    self._make()

    def _make(self) -> None:
        extend = self._holds('run')
        started_s = time.monotonic()
        try:
            with _signals(lambda number, _: self._signals.append(number)):
                say(f'setting up {self.path}: once, {SIZES[self._group]}')
                self._install(extend=extend)
        except (SetupError, OSError) as error:
            with _signals(signal.SIG_IGN):
                kept = extend and _can_run(str(self.python), CHECK)
                if not kept:
                    self._discard()
            advice = 'Start the same command again to retry.'
            if not isinstance(error, InterruptedSetupError):
                advice = f'It needs the package index and {SIZES[self._group]} of disk. {advice}'
            outcome = 'still serves the other commands' if kept else 'was removed'
            message = f'the set-up failed: {error}\n{self.path} {outcome}. {advice}'
            raise SetupError(message, getattr(error, 'status', 1)) from None
        say(f'ready after {time.monotonic() - started_s:.0f} s')

    def _install(self, *, extend: bool) -> None:
        if not extend:
            base = base_python()
            self._discard()
            self.path.mkdir()
            self._marker.touch()
            self._run('virtual environment', [base, '-m', 'venv', str(self.path)])
            tools = self.path / 'build-tools.txt'
            tools.write_text(build_tools((self._root / LOCKS['run']).read_text()))
            self._run('build tools', [*self._pip(), '-q', *LOCKED, str(tools)])
        lock = self._root / LOCKS[self._group]
        self._run('locked packages', *([*c, *LOCKED, str(lock)] for c in self._installers()))
        own = ('--no-deps', '--no-build-isolation', '-e', str(self._root))
        self._run('goalreach', *([*command, *own] for command in self._installers()))
        self._run('check', [str(self.python), '-I', '-c', CHECK])
        groups = list(LOCKS)[: list(LOCKS).index(self._group) + 1]
        self._marker.write_text('\n'.join(map(self._fingerprint, groups)))

    def _pip(self) -> list[str]:
        return [str(self.python), '-m', 'pip', 'install', *PIP_OPTIONS]

    def _installers(self) -> Iterator[list[str]]:
        """Yield the commands that can install, best first."""
        uv = self.path / 'bin' / 'uv'
        if uv.exists():
            yield [str(uv), 'pip', 'install', *UV_OPTIONS, '--python', str(self.python)]
        yield self._pip()

    def _run(self, step: str, *commands: list[str]) -> None:
        """Run the first of some commands that succeeds.

        Raises:
            SetupError: None does.
        """
        say(step)
        scratch = self.path / 'tmp'
        inherited = {k: v for k, v in os.environ.items() if k not in FOREIGN_SETTINGS}
        environment = {**self._uv_settings(), **inherited, 'TMPDIR': str(scratch)}
        for command in commands:
            scratch.mkdir(exist_ok=True)
            try:
                status = self._status(command, environment)
            finally:
                shutil.rmtree(scratch, ignore_errors=True)
            if status == 0:
                return
        raise SetupError(f'{step}: exit status {status}')

    def _uv_settings(self) -> dict[str, str]:
        if self._uv_variables is None and (self.path / 'bin' / 'uv').exists():
            command = [str(self.python), '-m', 'pip', 'config', 'list']
            listed = subprocess.run(command, capture_output=True, text=True, check=False)
            self._uv_variables = uv_variables(listed.stdout)
        return self._uv_variables or {}

    def _status(self, command: list[str], environment: dict[str, str]) -> int:
        """Run a command to its end, in a session of its own that a signal to us kills whole."""
        with subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=STDERR,
            start_new_session=True,
            pass_fds=[self._lock],  # the lock is held until the command has ended too
        ) as child:
            while not self._signals:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    return child.wait(timeout=0.1)
            os.killpg(child.pid, signal.SIGKILL)
        number = self._signals[0]
        raise InterruptedSetupError(f'interrupted by {signal.Signals(number).name}', 128 + number)

    def _holds(self, group: str) -> bool:
        """Return whether a group is installed, from the present lock and in this place."""
        installed = self._marker.read_text().split('\n') if self._marker.is_file() else []
        return self._fingerprint(group) in installed and self.python.exists()

    def _fingerprint(self, group: str) -> str:
        """Return the marker's line of an installed group.

        It changes with the lock and with the place: scripts in an environment hold its path.
        """
        content = (self._root / LOCKS[group]).read_bytes() + os.fsencode(self._root)
        return hashlib.sha256(content).hexdigest()

    def _discard(self) -> None:
        """Remove the environment; if killed half-way, it is not mistaken for a foreign one."""
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


def uv_variables(settings: str) -> dict[str, str]:
    r"""Return the environment variables by which uv follows the settings of pip.

    Args:
        settings: Output of `pip config list`; variables come after files there too.

    Example:
        >>> uv_variables("global.find-links='/a\\n/b'\nglobal.timeout='3'\n")
        {'UV_FIND_LINKS': '/a,/b'}
    """
    variables = {}
    for section in ('global', 'install', ':env:'):
        for key, value in re.findall(rf"^{section}\.([a-z-]+)='(.*)'$", settings, re.MULTILINE):
            if key in UV_VARIABLES:
                separator = ',' if key == 'find-links' else ' '
                variables[UV_VARIABLES[key]] = separator.join(value.replace('\\n', ' ').split())
    return variables


def base_python() -> str:
    """Return a Python that can make the environment.

    Raises:
        SetupError: There is none; the message names what is missing.
    """
    libc, version = platform.libc_ver()
    numbers = tuple(int(part) for part in re.findall(r'\d+', version)[:2])
    here = (sys.platform, platform.machine(), libc)
    if here != ('linux', 'x86_64', 'glibc') or numbers < OLDEST_GLIBC:
        message = (
            'ROS 2 comes as wheels for Linux on x86_64 with glibc 2.28 or newer only: on this '
            'machine, source a ROS 2 Jazzy workspace first.'
        )
        raise SetupError(message)
    python = _supported_python()
    if not _can_run(python, 'import ensurepip, venv'):
        message = (
            f'{python} has no venv module: install it (Debian and Ubuntu: `sudo apt install '
            'python3-venv`), then start the same command again.'
        )
        raise SetupError(message)
    return python


def own_base() -> str:
    """Return this Python, or the one that its virtual environment was made from."""
    path = Path(sys.base_prefix, 'bin', f'python3.{sys.version_info[1]}')
    return str(path) if path.exists() else sys.executable


def _supported_python() -> str:
    if sys.version_info[1] in SUPPORTED_MINORS:
        return own_base()
    for minor in SUPPORTED_MINORS:
        path = shutil.which(f'python3.{minor}')
        if path and _can_run(path, 'pass'):
            return path
    message = (
        'ROS 2 Jazzy comes as wheels for Python 3.10 to 3.13, and none of them was found (this is '
        f'{platform.python_version()}): install one and start the same command with it.'
    )
    raise SetupError(message)


def _can_run(python: str, code: str) -> bool:
    command = [python, '-I', '-c', code]
    return not subprocess.run(command, capture_output=True, check=False).returncode


@contextlib.contextmanager
def _signals(
    handler: Callable[[int, FrameType | None], object] | signal.Handlers,
) -> Iterator[None]:
    """Handle SIGINT, SIGTERM and SIGHUP inside the block."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, handler) for number in numbers]
    try:
        yield
    finally:
        for number, old in zip(numbers, before, strict=True):
            signal.signal(number, old)


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
