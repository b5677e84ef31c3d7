"""Writing a bag: a directory of storage files and their metadata."""

from collections.abc import Callable, Mapping
from copy import deepcopy
import errno
from pathlib import Path
import time
from typing import Final, NoReturn

from goalreach_bags.mcap_file import McapWriter
from goalreach_bags.metadata import BagMetadata, metadata_text, total_span, write_metadata
from goalreach_bags.options import StorageOptions
from goalreach_bags.sqlite_file import SqliteWriter
from goalreach_bags.storage import SUFFIXES, BagError, BagStoppedError, FileSpan, require_new_bag
from goalreach_bags.topic import BagTopic
from goalreach_msgs_py.errors import FileFormatError

_StorageFile = McapWriter | SqliteWriter
FLUSH_S: Final = 1.0
"""Longest time for which messages are in memory alone, lost at a sudden death. Chosen."""


class BagWriter:
    """A bag open for writing.

    Attributes:
        path: Its directory.
        custom: Texts that the metadata keeps.

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
        self._topics: dict[str, BagTopic] = {}
        self._numbers: dict[str, int] = {}
        self._done: list[FileSpan] = []
        self.custom: dict[str, str] = {}
        self._flushed_s = now()
        require_new_bag(self.path)
        try:
            self.path.mkdir(parents=True)
            self._file: _StorageFile | None = self._open_file()
        except OSError as error:
            raise BagError(path, f'cannot be made: {error.strerror}') from None

    @property
    def size(self) -> int:
        """Bytes of all files."""
        closed = sum((self.path / span.name).stat().st_size for span in self._done)
        return closed if self._file is None else closed + self._file.size

    def add_topic(self, topic: BagTopic) -> None:
        """Add a topic before its first message.

        Raises:
            BagStoppedError: The disk is full or failed.
        """
        self._topics[topic.name] = topic
        self._numbers[topic.name] = len(self._topics)
        self._do(lambda: self._storage.add_topic(self._numbers[topic.name], topic))

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
        number = self._numbers[name]
        published_ns = time_ns if publish_ns is None else publish_ns
        self._do(lambda: self._storage.write(number, time_ns, published_ns, data))
        self._span.add(name, time_ns)
        if self._storage.wants_flush:
            self._do(self._flush)

    def flush_if_due(self) -> None:
        """Flush messages older than `FLUSH_S`; to be called several times a second.

        Raises:
            BagStoppedError: The disk is full or failed.
        """
        now_s = self._now()
        if now_s - self._flushed_s >= FLUSH_S:
            self._do(self._flush)

    def close(self, custom: Mapping[str, str] | None = None) -> BagMetadata:
        """Finish the bag.

        Args:
            custom: More texts that the metadata keeps.

        Raises:
            BagStoppedError: The disk is full or failed.
        """
        self.custom.update(custom or {})
        self._do(self._finish)
        return self.metadata()

    def metadata(self) -> BagMetadata:
        """Return the metadata of what was written so far."""
        spans = tuple(self._done if self._file is None else [*self._done, self._span])
        options = self._options
        return BagMetadata(
            storage=options.storage,
            topics=tuple(self._topics.values()),
            files=spans,
            total=total_span(spans),
            compression_mode='MESSAGE' if options.zstd and options.storage == 'sqlite3' else '',
            custom=self.custom,
        )

    @property
    def _storage(self) -> _StorageFile:
        if self._file is None:
            raise BagError(self.path, 'is closed')
        return self._file

    def _open_file(self) -> _StorageFile:
        suffix = SUFFIXES[self._options.storage]
        self._span = FileSpan(name=f'{self.path.name}_{len(self._done)}{suffix}')
        self._flushed = deepcopy(self._span)
        make = McapWriter if self._options.storage == 'mcap' else SqliteWriter
        return make(self.path / self._span.name, zstd=self._options.zstd)

    def _is_full(self, time_ns: int) -> bool:
        options = self._options
        if not self._span.counts:
            return False
        lasts_ns = time_ns - self._span.first_ns
        return self._storage.size >= options.max_bytes or lasts_ns >= options.max_duration_ns

    def _flush(self) -> None:
        self._flushed_s = self._now()
        self._storage.flush()
        self._flushed = deepcopy(self._span)

    def _split(self) -> None:
        self._finish_file()
        self._file = self._open_file()
        for name, topic in self._topics.items():
            self._file.add_topic(self._numbers[name], topic)

    def _finish_file(self) -> None:
        self._flush()
        self._storage.finish(metadata_text(self.metadata()))
        self._file = None
        self._done.append(self._flushed)

    def _finish(self) -> None:
        if self._file is not None:
            self._finish_file()
        write_metadata(self.path, self.metadata())

    def _do(self, action: Callable[[], None]) -> None:
        try:
            action()
        except (OSError, FileFormatError) as error:
            self._stop(error)

    def _stop(self, error: OSError | FileFormatError) -> NoReturn:
        """Close the bag after the last messages that were flushed."""
        number = error.errno if isinstance(error, OSError) else None
        full = number in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        reason = 'the disk is full' if full else getattr(error, 'strerror', None) or str(error)
        rest = 'the bag so far is complete'
        try:
            if self._file is not None:
                self._file.drop_pending()
                self._span = deepcopy(self._flushed)
            self._finish()
        except (OSError, FileFormatError):
            rest = 'the bag so far needs record --repair'
            if self._file is not None:
                self._file.close()
                self._file = None
        raise BagStoppedError(self.path, f'{reason}: recording stopped, {rest}')
