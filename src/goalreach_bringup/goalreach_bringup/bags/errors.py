"""What can go wrong with a bag."""

from __future__ import annotations

from pathlib import Path

from goalreach_msgs_py.errors import FileFormatError

__all__ = ['BagError', 'BagStoppedError']


class BagError(FileFormatError):
    """A bag cannot be used or made; the text is `path: problem`."""


class BagStoppedError(BagError):
    """The disk took no more: the bag was closed early and holds what was written until then.

    Attributes:
        closed: Whether the bag is complete in itself; if not, it must be repaired.
    """

    def __init__(self, path: str | Path, problem: str, *, closed: bool) -> None:
        self.closed = closed
        super().__init__(path, problem)
