"""Environment of a graph: variables, run directory, domain lock, shared memory."""

from collections.abc import Iterator, Mapping
import contextlib
from contextlib import contextmanager
import fcntl
import os
from pathlib import Path
import re
import shutil
import tempfile
import time
from typing import IO, Final

from goalreach_bringup.launch.child_process import IMPORT_ENVIRONMENT
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile
from goalreach_msgs_py.ros.node import LAUNCHER_PID


def graph_environment(base: Mapping[str, str], log_directory: Path) -> dict[str, str]:
    """Return the environment of the graph's processes.

    A Fast DDS profile and a number of threads that are set already are kept.

    Args:
        base: The environment to start from.
        log_directory: Folder for the logs of ROS.
    """
    return {
        'FASTRTPS_DEFAULT_PROFILES_FILE': fast_dds_profile(),
        **IMPORT_ENVIRONMENT,
        **base,
        'ROS_LOG_DIR': str(log_directory),
        'RCUTILS_LOGGING_USE_STDOUT': '0',
        'RCUTILS_COLORIZED_OUTPUT': '0',
        LAUNCHER_PID: str(os.getpid()),
    }


def make_run_directory() -> Path:
    """Create and return the directory of this run's logs, in that of ROS; remove old ones.

    Raises:
        GoalreachError: It cannot be created.
    """
    home = os.environ.get('ROS_HOME') or str(Path.home() / '.ros')
    base = Path(os.environ.get('ROS_LOG_DIR') or Path(home) / 'log')
    stamp = time.strftime('%Y-%m-%d-%H-%M-%S')
    directory = base / f'goalreach-{stamp}-{os.getpid()}'
    try:
        directory.mkdir(parents=True)
    except OSError as error:
        raise GoalreachError(f'{directory}: cannot be created: {error.strerror}') from None
    _remove_old_runs(base)
    return directory


def _remove_old_runs(base: Path) -> None:
    """Remove the directories of all but the last runs; those of running processes stay."""
    runs = sorted(path for path in base.iterdir() if _RUN_DIRECTORY.fullmatch(path.name))
    for path in runs[:-_KEPT_RUNS]:
        running = Path('/proc', path.name.rpartition('-')[2]).exists()
        if not running and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)


_RUN_DIRECTORY: Final = re.compile(r'goalreach-\d{4}(-\d\d){5}-\d+')
_KEPT_RUNS: Final = 20
"""Chosen: a day's work, some megabytes."""

FIRST_DOMAIN: Final = 10


class DomainTakenError(GoalreachError):
    """Another stack runs in the ROS domain."""


@contextmanager
def domain_lock() -> Iterator[None]:
    """Lock this process's ROS domain; the kernel releases it however the process ends.

    Raises:
        GoalreachError: Another stack of this user holds it.
    """
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    with open_domain_file(domain) as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            stream.seek(0)
            holder = stream.read().strip() or 'unknown'
            raise DomainTakenError(
                f'ROS_DOMAIN_ID = {domain}: another graph runs there (process {holder}); '
                'stop it, or choose another domain for this one'
            ) from None
        stream.seek(0)
        stream.truncate()
        stream.write(f'{os.getpid()}\n')
        stream.flush()
        yield


def open_domain_file(domain: str) -> IO[str]:
    """Open the lock file of a ROS domain, made where it is missing.

    Raises:
        GoalreachError: It cannot be opened.
    """
    path = Path(tempfile.gettempdir()) / f'goalreach-{os.getuid()}-domain-{domain}.lock'
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    except OSError as error:
        raise GoalreachError(f'{path}: cannot be opened: {error.strerror}') from None
    return os.fdopen(descriptor, 'r+', encoding='utf-8', errors='replace')


SHARED_MEMORY: Final = Path('/dev/shm')  # noqa: S108 - where Linux and Fast DDS keep it
_LOCK_SUFFIX: Final = '_el'
_YOUNG_S: Final = 2.0
"""A segment is created before it is locked; files younger than this are kept. Chosen."""


def abandoned_files(folder: Path = SHARED_MEMORY, *, young_s: float = _YOUNG_S) -> list[Path]:
    """Return the Fast DDS files of this user that no living process uses.

    A process that receives through a segment or a port locks a second file whose name ends in
    `_el`; one that sends has mapped the segment, and would continue to send into the deleted file
    if its name were reused. Both are checked.

    Args:
        folder: Folder of the files.
        young_s: Files changed within this time count as used.
    """
    mapped = _mapped_names()
    bases = {path.name.removesuffix(_LOCK_SUFFIX) for path in folder.glob('fastrtps_*')}
    found: list[Path] = []
    for name in sorted(bases - mapped):
        files = [
            path
            for path in (folder / name, folder / f'sem.{name}_mutex', folder / f'{name}_el')
            if path.exists()
        ]
        if all(_is_abandoned(path, young_s) for path in files):
            found += files
    return found


def present_files(folder: Path = SHARED_MEMORY) -> list[Path]:
    """Return all Fast DDS files, of living and of dead processes."""
    return [*folder.glob('fastrtps_*'), *folder.glob('sem.fastrtps_*')]


def remove_abandoned(folder: Path = SHARED_MEMORY) -> int:
    """Remove the abandoned files; return their number."""
    files = abandoned_files(folder)
    for path in files:
        with contextlib.suppress(OSError):
            path.unlink()
    return len(files)


def _is_abandoned(path: Path, young_s: float) -> bool:
    try:
        status = path.stat()
        if status.st_uid != os.getuid() or time.time() - status.st_mtime < young_s:
            return False
        if path.name.endswith(_LOCK_SUFFIX):
            with path.open('rb') as stream:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _mapped_names() -> set[str]:
    """Return the names of files in shared memory that a process of this user has mapped."""
    names: set[str] = set()
    for maps in Path('/proc').glob('[0-9]*/maps'):
        with contextlib.suppress(OSError):
            text = maps.read_text(errors='replace')
            names.update(re.findall(rf'{SHARED_MEMORY}/(\S+)', text))
    return names
