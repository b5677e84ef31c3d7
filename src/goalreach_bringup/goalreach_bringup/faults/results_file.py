"""Verdicts on disk, one line each, so that a long measurement goes on where it ended."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

from goalreach_bringup.faults.judge import Verdict
from goalreach_msgs_py.errors import FileFormatError

__all__ = ['VerdictFile', 'read_verdicts']


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
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open('a', encoding='utf-8') as stream:
                stream.write(json.dumps(verdict.to_json()) + '\n')
        except OSError as error:
            raise FileFormatError(self._path, f'cannot be written: {error.strerror}') from None


def read_verdicts(folder: Path) -> list[Verdict]:
    """Return the verdicts of a folder, in no order; a line that was cut off is left out."""
    verdicts = []
    for path in sorted(folder.glob('faults*.jsonl')):
        for line in path.read_text(encoding='utf-8', errors='replace').splitlines():
            with contextlib.suppress(ValueError, TypeError):
                verdicts.append(Verdict(**json.loads(line)))
    return verdicts
