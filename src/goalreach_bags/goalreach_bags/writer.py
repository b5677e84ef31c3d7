"""Writing a bag: a directory of storage files and their metadata."""

from collections.abc import Callable
import errno
from pathlib import Path
import time
from typing import Final

from goalreach_bags.mcap_file import McapWriter
from goalreach_bags.metadata import BagMetadata, metadata_text, total_span, write_metadata
from goalreach_bags.options import StorageOptions
from goalreach_bags.sqlite_file import SqliteWriter
from goalreach_bags.storage import (
    SUFFIXES,
    BagError,
    BagStoppedError,
    FileSpan,
    StoredMessage,
    require_free_space,
    require_new_bag,
)
from goalreach_bags.topic import BagTopic
from goalreach_msgs_py.errors import FileFormatError

_StorageFile = McapWriter | SqliteWriter
_FLUSH_BYTES: Final = 768 * 1024
"""Size of a chunk, that of rosbag2's writer."""
FLUSH_S: Final = 1.0
"""Longest time for which messages are in memory only: a killed process loses them. Chosen."""


class BagWriter:
    """A bag open for writing.

    Attributes:
        path: Its directory.
        topics: Its topics by name.
        message_count: Number of its messages, those in memory included.
        custom: Texts that the metadata is to keep.

    Args:
        path: Its directory, which must not exist.
        options: How it is stored.
        now: Monotonic seconds; messages are flushed once they are `FLUSH_S` old.

    Raises:
        BagError: The directory exists, or cannot be made.
    """

    def __init__(
        self,
        path: str | Path,
        options: StorageOptions,
        *,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.path = Path(path)
        self._options = options
        self._now = now
        self.topics: dict[str, BagTopic] = {}
        self.message_count = 0
        self._spans: list[FileSpan] = []
        self.custom: dict[str, str] = {}
        self._pending: list[StoredMessage] = []
        self._pending_bytes = self._closed_bytes = 0
        self._flushed_s = now()
        self._file: _StorageFile | None = None
        require_new_bag(self.path)
        try:
            self.path.mkdir(parents=True)
            self._open_file()
        except OSError as error:
            raise BagError(path, f'cannot be made: {error.strerror}') from None

    @property
    def size(self) -> int:
        """Bytes of all files."""
        size = self._closed_bytes
        return size if self._file is None else size + self._file.size + self._pending_bytes

    def add_topic(self, topic: BagTopic) -> None:
        """Add a topic before its first message.

        Raises:
            BagStoppedError: The disk is full or failed.
        """
        self.topics[topic.name] = topic
        self._do(lambda: self._storage.add_topic(topic))

    def write(self, name: str, time_ns: int, data: bytes, publish_ns: int | None = None) -> None:
        """Add a message of a topic.

        Args:
            name: The topic.
            time_ns: Receive time.
            data: The serialized message.
            publish_ns: When it was published, the receive time if None.

        Raises:
            BagStoppedError: The disk is full or failed.
        """
        if self._is_full(time_ns):
            self._do(self._split)
        published_ns = time_ns if publish_ns is None else publish_ns
        self._pending.append((name, time_ns, published_ns, data))
        self._pending_bytes += len(data)
        self.message_count += 1
        if self._pending_bytes >= _FLUSH_BYTES:
            self._do(self._flush)

    def flush_if_due(self) -> None:
        """Flush messages older than `FLUSH_S`; to be called several times a second.

        Raises:
            BagStoppedError: The disk is full or failed.
        """
        if self._now() - self._flushed_s >= FLUSH_S:
            self._do(self._flush)

    def close(self) -> BagMetadata:
        """Finish the bag.

        Raises:
            BagStoppedError: The disk is full or failed.
        """
        self._do(self._finish)
        return self.metadata()

    def metadata(self) -> BagMetadata:
        """Return the metadata of what was flushed so far."""
        options = self._options
        return BagMetadata(
            storage=options.storage,
            topics=tuple(self.topics.values()),
            files=tuple(self._spans),
            total=total_span(self._spans),
            compression_mode='MESSAGE' if options.zstd and options.storage == 'sqlite3' else '',
            custom=self.custom,
        )

    @property
    def _storage(self) -> _StorageFile:
        if self._file is None:
            raise BagError(self.path, 'is closed')
        return self._file

    def _open_file(self) -> None:
        suffix = SUFFIXES[self._options.storage]
        name = f'{self.path.name}_{len(self._spans)}{suffix}'
        make = McapWriter if self._options.storage == 'mcap' else SqliteWriter
        self._file = make(self.path / name, zstd=self._options.zstd)
        self._spans.append(FileSpan(name=name))

    def _is_full(self, time_ns: int) -> bool:
        span = self._spans[-1]
        if not (span.counts or self._pending):
            return False
        began_ns = span.first_ns if span.counts else self._pending[0][1]
        max_mb, max_s = self._options.max_size, self._options.max_duration
        size = self._storage.size + self._pending_bytes
        is_large = max_mb is not None and size >= max_mb * 1e6
        return is_large or (max_s is not None and time_ns - began_ns >= max_s * 1e9)

    def _flush(self) -> None:
        self._flushed_s = self._now()
        if self._pending:
            # Twice the messages: SQLite writes to its journal, too.
            needed = 2 * self._pending_bytes + self._storage.closing_bytes
            require_free_space(self.path / self._spans[-1].name, needed)
            self._storage.append(self._pending)
            for name, time_ns, _, _ in self._pending:
                self._spans[-1].add(name, time_ns)
            self._pending, self._pending_bytes = [], 0

    def _split(self) -> None:
        self._finish_file()
        self._open_file()
        for topic in self.topics.values():
            self._storage.add_topic(topic)

    def _finish_file(self) -> None:
        self._flush()
        self._storage.finish(metadata_text(self.metadata()))
        self._file = None
        self._closed_bytes += (self.path / self._spans[-1].name).stat().st_size

    def _finish(self) -> None:
        if self._file is not None:
            self._finish_file()
        write_metadata(self.path, self.metadata())

    def _do(self, action: Callable[[], None]) -> None:
        """Act on the files; where that fails, close the bag after what was flushed before."""
        try:
            action()
        except (OSError, FileFormatError) as error:
            full = getattr(error, 'errno', None) in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
            reason = 'the disk is full' if full else getattr(error, 'strerror', None) or str(error)
        else:
            return
        rest = 'the bag so far is complete'
        try:
            self._pending, self._pending_bytes = [], 0
            self._finish()
        except (OSError, FileFormatError):
            rest = 'the bag so far needs record --repair'
            if self._file is not None:
                self._file.close()
                self._file = None
        raise BagStoppedError(self.path, f'{reason}: recording stopped, {rest}')
