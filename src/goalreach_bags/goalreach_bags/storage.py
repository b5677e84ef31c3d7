"""Storage of a bag: what a storage file must offer, its messages in short, and the errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import errno
import os
from pathlib import Path
import shutil
from typing import Final, Protocol

from goalreach_bags.topic import BagTopic
from goalreach_msgs_py.errors import FileFormatError

STORAGES: Final = ('mcap', 'sqlite3')
SUFFIXES: Final = {'mcap': '.mcap', 'sqlite3': '.db3'}
ZSTD_LEVEL: Final = 1
"""Chosen: a camera's noise hardly shrinks more at higher levels, which cost far more."""

NO_TIME_NS: Final = 2**63 - 1
"""Start of a bag without messages, as rosbag2 writes it."""

_MARGIN_BYTES: Final = 256 * 1024
"""Left for summary and metadata, and for other processes that write. Chosen."""


class BagError(FileFormatError):
    """A bag cannot be used or made; the text is `path: problem`."""


class BagStoppedError(BagError):
    """The disk is full or failed: the bag was closed early.

    Attributes:
        closed: Whether the bag is complete in itself; if not, it must be repaired.
    """

    def __init__(self, path: str | Path, problem: str, *, closed: bool) -> None:
        self.closed = closed
        super().__init__(path, problem)


@dataclass(frozen=True, kw_only=True)
class FileSpan:
    """Messages of one file of a bag.

    Attributes:
        name: File name inside the bag's directory.
        counts: Messages by topic name.
        first_ns: Earliest receive time; `NO_TIME_NS` while there is no message.
        last_ns: Latest receive time.
    """

    name: str
    counts: Mapping[str, int] = field(default_factory=dict)
    first_ns: int = NO_TIME_NS
    last_ns: int = 0

    @property
    def message_count(self) -> int:
        """Messages of all topics."""
        return sum(self.counts.values())

    @property
    def duration_ns(self) -> int:
        """Time between the first and the last message."""
        return max(0, self.last_ns - self.first_ns)


class StorageFile(Protocol):
    """One file of a bag being written.

    What has been flushed survives the death of the process. Every method may raise OSError; the
    file then still ends after what was flushed before.
    """

    @property
    def size(self) -> int:
        """Bytes so far, those in memory included."""
        ...

    @property
    def wants_flush(self) -> bool:
        """Whether enough is buffered to be flushed."""
        ...

    def add_topic(self, number: int, topic: BagTopic) -> None:
        """Add a topic before its first message."""
        ...

    def write(self, number: int, time_ns: int, publish_ns: int, data: bytes) -> None:
        """Add a message."""
        ...

    def flush(self) -> None:
        """Write buffered messages to the operating system."""
        ...

    def drop_pending(self) -> None:
        """Discard buffered messages, for which the disk has no space."""
        ...

    def finish(self, metadata: str) -> None:
        """Flush, add the bag's metadata, and close."""
        ...

    def close(self) -> None:
        """Close without metadata."""
        ...


def require_free_space(path: Path, needed: int) -> None:
    """Check that a file can grow, before anything is written.

    Args:
        path: The file.
        needed: By how many bytes.

    Raises:
        OSError: ENOSPC.
    """
    if shutil.disk_usage(path.parent).free < needed + _MARGIN_BYTES:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
