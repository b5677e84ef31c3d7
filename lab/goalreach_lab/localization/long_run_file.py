"""A long drive on disk: a line for each minute, and the robot itself, so that it can go on."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import json
from pathlib import Path
import pickle
from typing import Any

from goalreach_lab.localization.long_run import LongRun
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.files import write_bytes_atomically

_KEEP_EVERY = 10
"""Minutes after which the robot is kept; chosen: what is lost at most is driven in seconds."""


def read_minutes(path: Path) -> list[dict[str, Any]]:
    """Return the minutes of a file, those that were written whole."""
    if not path.exists():
        return []
    minutes: list[dict[str, Any]] = []
    with contextlib.suppress(ValueError):  # a line cut off ends it
        for line in path.read_text(encoding='utf-8').splitlines():
            minutes.append(json.loads(line))  # noqa: PERF401 - what is there is kept
    return minutes


def drive_on(
    path: Path,
    *,
    minutes: int,
    seed: int,
    progress: Callable[[int], None] = lambda _: None,
) -> list[dict[str, Any]]:
    """Drive until so many minutes are there, from where an earlier drive ended.

    Args:
        path: File of JSON lines; the robot is kept beside it.
        minutes: How many in all.
        seed: Of everything random.
        progress: Called with 1 after each minute.

    Returns:
        The minutes.

    Raises:
        FileFormatError: A file cannot be written.
    """
    keep = path.with_suffix('.robot')
    run = _kept(keep) or LongRun(seed)
    done = read_minutes(path)[: run.minutes]
    if len(done) < run.minutes:
        run, done = LongRun(seed), []
    _write(path, 'w', done)
    progress(len(done))
    while len(done) < minutes:
        done.append(run.drive())
        _write(path, 'a', done[-1:])
        if run.minutes % _KEEP_EVERY == 0:
            write_bytes_atomically(keep, pickle.dumps(run))
        progress(1)
    return done[:minutes]


def _kept(path: Path) -> LongRun | None:
    """Return the robot that was kept, or None where there is none that can be used."""
    try:
        run = pickle.loads(path.read_bytes())  # noqa: S301 - written by this module alone
    except (OSError, pickle.UnpicklingError, AttributeError, EOFError, ImportError):
        return None
    return run if isinstance(run, LongRun) else None


def _write(path: Path, how: str, minutes: list[dict[str, Any]]) -> None:
    try:
        with path.open(how, encoding='utf-8') as file:
            file.writelines(json.dumps(minute) + '\n' for minute in minutes)
    except OSError as error:
        raise FileFormatError(path, f'cannot be written: {error.strerror}') from None
