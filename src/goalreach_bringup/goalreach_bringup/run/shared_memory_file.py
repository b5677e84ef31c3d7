"""Shared memory that Fast DDS left behind: a process that was killed cannot give it back."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import fcntl
import os
from pathlib import Path
import time
from typing import Final

__all__ = ['SHARED_MEMORY', 'abandoned_files', 'remove_abandoned']

SHARED_MEMORY: Final = Path('/dev/shm')  # noqa: S108 - where Linux and Fast DDS keep it
_LOCK_SUFFIX: Final = '_el'
_YOUNG_S: Final = 2.0
"""A segment is made before it is locked; files younger than this are left alone. Chosen."""


def abandoned_files(folder: Path = SHARED_MEMORY, *, young_s: float = _YOUNG_S) -> list[Path]:
    """Return this person's Fast DDS files whose every user has died.

    A process that uses a segment or a port holds a lock on the file beside it whose name ends in
    `_el`; the kernel lets go of it when the process dies.

    Args:
        folder: Where they are.
        young_s: Files changed within so many seconds are taken for being in use.
    """
    found: list[Path] = []
    for lock in sorted(folder.glob(f'fastrtps_*{_LOCK_SUFFIX}')):
        if _is_abandoned(lock, young_s):
            found += [path for path in _belonging_to(lock) if path.exists()]
    return found


def remove_abandoned(folder: Path = SHARED_MEMORY) -> int:
    """Remove what `abandoned_files` tells; return how many files that were."""
    files = abandoned_files(folder)
    for path in files:
        with contextlib.suppress(OSError):
            path.unlink()
    return len(files)


def _is_abandoned(lock: Path, young_s: float) -> bool:
    try:
        status = lock.stat()
        if status.st_uid != os.getuid() or time.time() - status.st_mtime < young_s:
            return False
        with lock.open('rb') as stream:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _belonging_to(lock: Path) -> Iterator[Path]:
    name = lock.name.removesuffix(_LOCK_SUFFIX)
    yield lock.with_name(name)
    yield lock.with_name(f'sem.{name}_mutex')
    yield lock
