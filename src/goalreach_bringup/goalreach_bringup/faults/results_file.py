"""Verdicts on disk, one line each, so that a long measurement goes on where it ended."""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
import json
from pathlib import Path
from typing import Any

from goalreach_bringup.faults.judge import Verdict
from goalreach_msgs_py.errors import FileFormatError

__all__ = ['VerdictFile', 'append_line', 'read_lines', 'read_verdicts']


class VerdictFile:
    """A file that grows by one verdict at a time.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def add(self, verdict: Verdict) -> None:
        """Append a verdict.

        Raises:
            FileFormatError: It cannot be written.
        """
        append_line(self._path, verdict.to_json())


def append_line(path: Path, values: Mapping[str, object]) -> None:
    """Append values to a file as one line of JSON.

    Raises:
        FileFormatError: It cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open('a', encoding='utf-8') as stream:
            stream.write(json.dumps(dict(values)) + '\n')
    except OSError as error:
        raise FileFormatError(path, f'cannot be written: {error.strerror}') from None


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Return the lines of such a file; none where it is not there, whole ones only."""
    lines = []
    if path.exists():
        for line in path.read_text(encoding='utf-8', errors='replace').splitlines():
            with contextlib.suppress(ValueError):
                lines.append(json.loads(line))
    return lines


def read_verdicts(folder: Path) -> list[Verdict]:
    """Return the verdicts of a folder, in no order; a line that was cut off is left out."""
    verdicts = []
    for path in sorted(folder.glob('faults*.jsonl')):
        for line in read_lines(path):
            with contextlib.suppress(TypeError):
                verdicts.append(Verdict(**line))
    return verdicts
