"""Storage of a bag: formats, extent and soundness of a file, free disk space, and the errors."""

from abc import ABC, abstractmethod
from collections import Counter
from dataclasses import dataclass, field
import errno
import os
from pathlib import Path
import shutil
from typing import Final

from goalreach_bags.topic import BagTopic
from goalreach_msgs_py.errors import FileFormatError

STORAGES: Final = ('mcap', 'sqlite3')
SUFFIXES: Final = {'mcap': '.mcap', 'sqlite3': '.db3'}
ZSTD_LEVEL: Final = 1
"""Chosen: a camera's noise hardly shrinks more at higher levels, which cost far more."""

ZSTD_MAGIC: Final = b'\x28\xb5\x2f\xfd'
NO_TIME_NS: Final = 2**63 - 1
"""Start of a bag without messages, as rosbag2 writes it."""

NOT_CLOSED: Final = 'it was not closed by its recorder'
"""Damage of a file whose writer was killed."""

_PROBLEMS: Final = 3
"""So many problems of a file are shown; the others are counted."""

_MARGIN_BYTES: Final = 256 * 1024
"""Left for summary and metadata, and for other processes that write. Chosen."""


class BagError(FileFormatError):
    """A bag cannot be used or made; the text is `path: problem`."""


class BagStoppedError(BagError):
    """The disk is full or failed: the bag was closed early, or has to be repaired."""


@dataclass(frozen=True, kw_only=True, order=True)
class BagMessage:
    """A message of a bag, ordered by time, topic and data.

    The data decides between several publishers of a topic, which have no other order.

    Attributes:
        time_ns: Receive time.
        topic: Name of its topic.
        data: The serialized message.
    """

    time_ns: int
    topic: str
    data: bytes


StoredMessage = tuple[str, int, int, bytes]
"""Topic, receive time, time of publication, and data of a message for a file."""


@dataclass(kw_only=True)
class FileSpan:
    """Counts and times of the messages of one file of a bag, added while they are written or read.

    Attributes:
        name: File name inside the bag's directory.
        counts: Messages by topic name.
        first_ns: Earliest receive time; `NO_TIME_NS` while there is no message.
        last_ns: Latest receive time.
    """

    name: str
    counts: Counter[str] = field(default_factory=Counter)
    first_ns: int = NO_TIME_NS
    last_ns: int = 0

    def add(self, topic: str, time_ns: int) -> None:
        """Count a message."""
        self.counts[topic] += 1
        self.first_ns = min(self.first_ns, time_ns)
        self.last_ns = max(self.last_ns, time_ns)

    @property
    def message_count(self) -> int:
        """Messages of all topics."""
        return self.counts.total()

    @property
    def duration_ns(self) -> int:
        """Time between the first and the last message."""
        return max(0, self.last_ns - self.first_ns)


@dataclass(kw_only=True)
class StorageScan(ABC):
    """Result of reading a storage file whole.

    Attributes:
        span: Its sound messages.
        problems: Why the file needs repair, in order; none for a sound file.
        compressed: Whether each message is compressed by itself.
        metadata: Copy of the bag's metadata, or empty.
        distro: ROS distribution, or empty.
        indexed: Whether its chunks, if it has any, can be found by an index.
        dropped_bytes: Bytes of records that are not sound.
    """

    path: Path
    span: FileSpan
    topics: tuple[BagTopic, ...] = ()
    problems: dict[str, None] = field(default_factory=dict)
    compressed: bool = False
    metadata: str = ''
    distro: str = ''
    indexed: bool = True
    dropped_bytes: int = 0

    @property
    def damage(self) -> str:
        """Why the file needs repair, on one line; empty for a sound file."""
        more = len(self.problems) - _PROBLEMS
        shown = '; '.join(list(self.problems)[:_PROBLEMS])
        return shown + (f'; {more} more' if more > 0 else '')

    @abstractmethod
    def write_repaired(self, target: Path, metadata: str) -> None:
        """Write what is sound to a new file, with new indexes and a copy of the bag's metadata."""


def storage_files(path: Path) -> list[Path]:
    """Return the storage files in a bag's directory, in the order of their numbers."""
    files = [file for suffix in SUFFIXES.values() for file in path.glob(f'*{suffix}')]
    return sorted(files, key=lambda file: (len(file.name), file.name))


def require_new_bag(path: Path) -> None:
    """Raise `BagError` where a path exists: a bag is never overwritten."""
    if path.exists() or path.is_symlink():
        raise BagError(path, 'exists already: a bag is never overwritten')


def require_free_space(path: Path, needed: int) -> None:
    """Raise OSError where a file cannot grow by so many bytes, before anything is written."""
    if shutil.disk_usage(path.parent).free < needed + _MARGIN_BYTES:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
