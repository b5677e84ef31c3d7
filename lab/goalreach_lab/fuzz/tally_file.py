"""What readers did with bad input, on disk, so that a long measurement goes on where it ended."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from goalreach_evaluation.summary_file import append_line, read_lines
from goalreach_lab.fuzz.reader import Tally
from goalreach_msgs_py.files import require_writable


class TallyFile:
    """Counts by reader, each step of them kept in a file where there is one.

    Args:
        path: The file, or None.

    Attributes:
        tallies: The counts by name of the reader.

    Raises:
        FileFormatError: The file cannot be written.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self.tallies: dict[str, Tally] = {}
        if path is None:
            return
        require_writable(path)
        for line in read_lines(path):
            tally = Tally(**line)
            self.of(tally.name).add(tally)

    def of(self, name: str) -> Tally:
        """Return what a reader did so far."""
        return self.tallies.setdefault(name, Tally(name))

    def add(self, tally: Tally) -> None:
        """Count what a reader did with further inputs."""
        if self._path is not None:
            append_line(self._path, asdict(tally))
        self.of(tally.name).add(tally)
