"""One file that a reader of ours takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from goalreach_lab.fuzz.reader import require_finite


@dataclass(frozen=True, kw_only=True)
class FileTarget:
    """One file that a reader takes.

    Attributes:
        name: What is read.
        sound: A value that it takes, or None for a file that is no document.
        write: How it becomes bytes.
        path: Where they are written.
        read: The reader.
        finite: Whether what it reads must hold finite numbers only; a later reader sees to it
            else.
    """

    name: str
    sound: object
    write: Callable[[object], bytes]
    path: Path
    read: Callable[[Path], object]
    finite: bool = True

    def take(self, data: bytes) -> object:
        """Write bytes, and return what is read.

        Raises:
            GoalreachError: They are refused.
            Nonsense: They are not, and should have been.
        """
        self.path.write_bytes(data)
        found = self.read(self.path)
        if self.finite:
            require_finite(found, self.name)
        return found
