"""Environment of a graph: variables, run directory, domain lock, shared memory."""

from collections.abc import Iterator, Mapping
import contextlib
import errno
import fcntl
import os
from pathlib import Path
import pwd
import re
import shutil
import socket
import struct
import time
from typing import Final

from goalreach_bringup.launch.child_process import IMPORT_ENVIRONMENT
from goalreach_bringup.variables import HIGHEST_DOMAIN
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.dds_profile import (
    PROFILE_VARIABLE,
    chosen_profile,
    count_local_participants,
    fast_dds_profile,
)
from goalreach_msgs_py.ros.process import LAUNCHER_PID


def graph_environment(base: Mapping[str, str], log_directory: Path) -> dict[str, str]:
    """Return the environment of the graph's processes.

    A Fast DDS profile and a number of threads that are set already are kept.
    """
    return {
        **IMPORT_ENVIRONMENT,
        **base,
        PROFILE_VARIABLE: chosen_profile(base, fast_dds_profile()),
        'ROS_LOG_DIR': str(log_directory),
        'RCUTILS_CONSOLE_OUTPUT_FORMAT': '[{severity}] [{time}] [{name}]: {message}',
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
    given = os.environ.get('ROS_LOG_DIR') or f'{home}/log'
    base = Path(os.path.expanduser(given))  # noqa: PTH111 - bears unknown users
    stamp = time.strftime('%Y-%m-%d-%H-%M-%S')
    directory = base / f'goalreach-{stamp}-{os.getpid()}'
    try:
        directory.mkdir(parents=True)
    except OSError as error:
        raise GoalreachError(f'{directory}: cannot be created: {error.strerror}') from None
    _remove_old_runs(base)
    return directory


def _remove_old_runs(base: Path) -> None:
    """Remove the directories of all but the last runs; of running processes and bags they stay."""
    runs = sorted(path for path in base.iterdir() if _RUN_DIRECTORY.fullmatch(path.name))
    for path in runs[:-_KEPT_RUNS]:
        running = Path('/proc', path.name.rpartition('-')[2]).exists()
        kept = path.is_symlink() or any(path.glob('bag_*'))  # recorded from the page
        if not running and not kept:
            shutil.rmtree(path, ignore_errors=True)


_RUN_DIRECTORY: Final = re.compile(r'goalreach-\d{4}(-\d\d){5}-\d+')
_KEPT_RUNS: Final = 20
"""Chosen: a day's work, some megabytes."""

FIRST_DOMAIN: Final = 10
_LOCK: Final = '\0goalreach-domain-'
"""Start of the name of the Unix socket that locks a domain. Names that begin with a zero byte are
no files: all users of a machine (of a network namespace) share them, and none outlives its
process."""
_PEER: Final = struct.Struct('iII')
"""Process, user and group of a socket's peer (`ucred` in unix(7))."""


@contextlib.contextmanager
def domain_lock(namespace: str = '') -> Iterator[bool]:
    """Lock this process's ROS domain against all users; it is released however the process ends.

    A run without a namespace holds the lock of the domain. One with a namespace holds that of the
    namespace, and the domain's where it is free.

    Yields:
        Whether it holds the lock of the domain, and with it `/clock`.

    Raises:
        GoalreachError: Another stack of this machine holds it.
    """
    with contextlib.ExitStack() as locks:
        if namespace:
            locks.enter_context(_lock(f'/{namespace}'))
        owns_domain = True
        try:
            locks.enter_context(_lock(''))
        except GoalreachError:
            owns_domain = False
            if not namespace:
                raise
        yield owns_domain


@contextlib.contextmanager
def _lock(suffix: str) -> Iterator[None]:
    domain = int(os.environ.get('ROS_DOMAIN_ID') or 0)
    name = f'{domain}{suffix}'
    with socket.socket(socket.AF_UNIX) as lock:
        try:
            lock.bind(f'{_LOCK}{name}')
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise GoalreachError(
                    f'ROS_DOMAIN_ID = {domain}: cannot be locked: {error.strerror}'
                ) from None
            where = f'in {suffix}' if suffix else 'there'
            raise GoalreachError(
                f'ROS_DOMAIN_ID = {domain}: another graph runs {where} ({_holder(name)}); stop '
                f'it, or start this one with ROS_DOMAIN_ID={next(unused_domains(), "another")}'
            ) from None
        lock.listen(socket.SOMAXCONN)
        yield


def unused_domains(first: int = FIRST_DOMAIN) -> Iterator[int]:
    """Yield the ROS domains, from `first` on, that nothing on this machine uses."""
    sockets = ''
    with contextlib.suppress(OSError):  # a sandbox may hide the table
        sockets = Path('/proc/net/unix').read_text(encoding='ascii', errors='replace')
    locked = set(re.findall(rf'@{_LOCK[1:]}(\d+)(?:/.*)?$', sockets, re.MULTILINE))
    for domain in range(first, HIGHEST_DOMAIN + 1):
        if str(domain) not in locked and not count_local_participants(domain):
            yield domain


def _holder(name: str) -> str:
    """Return process and user that hold a lock, as far as they can be known."""
    with socket.socket(socket.AF_UNIX) as probe:
        probe.setblocking(False)
        try:
            probe.connect(f'{_LOCK}{name}')
        except OSError:  # it ends just now, or too many have asked
            return 'process unknown'
        peer = probe.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER.size)
    pid, uid, _ = _PEER.unpack(peer)
    try:
        user = pwd.getpwuid(uid).pw_name
    except KeyError:
        user = str(uid)
    return f'process {pid or "of a container"} of user {user}'


SHARED_MEMORY: Final = Path('/dev/shm')  # noqa: S108 - where Linux and Fast DDS keep it
_LOCK_SUFFIX: Final = '_el'
_YOUNG_S: Final = 2.0
"""A segment is created before it is locked; files younger than this are kept. Chosen."""


def abandoned_files(folder: Path = SHARED_MEMORY) -> list[Path]:
    """Return the Fast DDS files of this user that no living process uses.

    A process that receives through a segment or a port locks a second file whose name ends in
    `_el`; one that sends has mapped the segment, and would continue to send into the deleted file
    if its name were reused. Both are checked.
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
        if all(_is_abandoned(path) for path in files):
            found += files
    return found


def remove_abandoned(folder: Path = SHARED_MEMORY) -> int:
    """Remove the abandoned files; return their number."""
    files = abandoned_files(folder)
    for path in files:
        with contextlib.suppress(OSError):
            path.unlink()
    return len(files)


def _is_abandoned(path: Path) -> bool:
    try:
        status = path.stat()
        if status.st_uid != os.getuid() or time.time() - status.st_mtime < _YOUNG_S:
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
