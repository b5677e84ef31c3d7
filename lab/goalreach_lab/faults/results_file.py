"""Verdicts on disk, one line each, so that a long measurement goes on where it ended."""

from __future__ import annotations

import contextlib
from pathlib import Path

from goalreach_evaluation.summary_file import append_line, read_lines
from goalreach_lab.faults.judge import Verdict


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


def read_verdicts(folder: Path) -> list[Verdict]:
    """Return the verdicts of a folder, in no order; a line that was cut off is left out."""
    verdicts = []
    for path in sorted(folder.glob('faults*.jsonl')):
        for line in read_lines(path):
            with contextlib.suppress(TypeError):
                verdicts.append(Verdict(**line))
    return verdicts
