"""One stack of a person in one ROS domain: two would drive each other's robots."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from contextlib import contextmanager
import fcntl
import os
from pathlib import Path
import tempfile
from typing import IO

from goalreach_msgs_py.errors import GoalreachError

__all__ = ['domain_lock', 'free_domains']

_FIRST = 10


class DomainTakenError(GoalreachError):
    """Another stack runs in the domain."""


@contextmanager
def domain_lock() -> Iterator[None]:
    """Hold this process's ROS domain; the kernel lets go of it however the process ends.

    Raises:
        GoalreachError: Another stack of this person holds it.
    """
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    with _open(domain) as stream:
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


def free_domains(count: int) -> list[int]:
    """Return domains in which no stack of this person runs now, from ROS_DOMAIN_ID on, else 10."""
    found: list[int] = []
    given = os.environ.get('ROS_DOMAIN_ID', '')
    domain = int(given) if given.isdecimal() else _FIRST
    while len(found) < count:
        with _open(str(domain)) as stream, contextlib.suppress(BlockingIOError):
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            found.append(domain)
        domain += 1
    return found


def _open(domain: str) -> IO[str]:
    path = Path(tempfile.gettempdir()) / f'goalreach-{os.getuid()}-domain-{domain}.lock'
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    except OSError as error:
        raise GoalreachError(f'{path}: cannot be opened: {error.strerror}') from None
    return os.fdopen(descriptor, 'r+', encoding='utf-8', errors='replace')
