"""Shared memory that Fast DDS left behind: a process that was killed cannot give it back."""

from __future__ import annotations

import contextlib
import fcntl
import os
from pathlib import Path
import re
import time
from typing import Final

__all__ = ['SHARED_MEMORY', 'abandoned_files', 'present_files', 'remove_abandoned']

SHARED_MEMORY: Final = Path('/dev/shm')  # noqa: S108 - where Linux and Fast DDS keep it
_LOCK_SUFFIX: Final = '_el'
_YOUNG_S: Final = 2.0
"""A segment is made before it is locked; files younger than this are left alone. Chosen."""


def abandoned_files(folder: Path = SHARED_MEMORY, *, young_s: float = _YOUNG_S) -> list[Path]:
    """Return this person's Fast DDS files whose every user has died.

    A process that receives through a segment or a port holds a lock on the file beside it whose
    name ends in `_el`; one that sends has mapped it, and would go on sending into the void where
    the name were given to a new file. Both are looked at.

    Args:
        folder: Where they are.
        young_s: Files changed within so many seconds are taken for being in use.
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
    """Return all files of Fast DDS, of living processes and of dead ones."""
    return [*folder.glob('fastrtps_*'), *folder.glob('sem.fastrtps_*')]


def remove_abandoned(folder: Path = SHARED_MEMORY) -> int:
    """Remove what `abandoned_files` tells; return how many files that were."""
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
    """Return the names of files in shared memory that a process of this person has mapped."""
    names: set[str] = set()
    for maps in Path('/proc').glob('[0-9]*/maps'):
        with contextlib.suppress(OSError):
            text = maps.read_text(errors='replace')
            names.update(re.findall(rf'{SHARED_MEMORY}/(\S+)', text))
    return names
