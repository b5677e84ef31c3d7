"""Writing one SQLite file with the tables of Jazzy's rosbag2."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import errno
from pathlib import Path
import sqlite3
from typing import Final

from goalreach_bringup.bags.metadata import METADATA_VERSION, ROS_DISTRO
from goalreach_bringup.bags.room import require_room
from goalreach_bringup.bags.topic import BagTopic, offers_to_text
from goalreach_bringup.bags.zstandard import compress

__all__ = ['SqliteWriter']

_TABLES: Final = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(
    id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(
    id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
    serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL,
    type_description_hash TEXT NOT NULL);
CREATE TABLE message_definitions(
    id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
    encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE messages(
    id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
    data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
"""
_SCHEMA_VERSION: Final = 4
_COMMIT_BYTES: Final = 4 * 1024 * 1024
"""Pending messages are committed at this size. Chosen."""


class SqliteWriter:
    """A `StorageFile` in the SQLite format; what is committed survives.

    Args:
        path: The file, which must not exist.
        zstd: Whether to compress each message.
    """

    def __init__(self, path: Path, *, zstd: bool) -> None:
        if path.exists():
            raise FileExistsError(errno.EEXIST, 'exists already', str(path))
        self._path = path
        self._zstd = zstd
        self._types: set[str] = set()
        self._committed = self._pending = 0
        with _as_os_error():
            self._base = sqlite3.connect(path, isolation_level=None)
            # The journal keeps a killed process's file sound; only a power cut needs the waiting.
            self._base.execute('PRAGMA synchronous=OFF')
            self._base.execute('PRAGMA journal_mode=TRUNCATE')
            self._base.execute('BEGIN')
            for statement in _TABLES.split(';'):
                self._base.execute(statement)
            self._base.execute('INSERT INTO schema VALUES(?, ?)', (_SCHEMA_VERSION, ROS_DISTRO))
            self._base.execute('COMMIT')

    @property
    def size(self) -> int:
        """Bytes of messages so far."""
        return self._committed + self._pending

    @property
    def wants_flush(self) -> bool:
        """Whether enough is pending for a commit."""
        return self._pending >= _COMMIT_BYTES

    def add_topic(self, number: int, topic: BagTopic) -> None:
        """Add a topic and the definition of its type."""
        with _as_os_error():
            self._begin()
            self._base.execute(
                'INSERT INTO topics VALUES(?, ?, ?, ?, ?, ?)',
                (
                    number,
                    topic.name,
                    topic.type_name,
                    'cdr',
                    offers_to_text(topic.offers),
                    topic.type_hash,
                ),
            )
            if topic.type_name not in self._types:
                self._types.add(topic.type_name)
                self._base.execute(
                    'INSERT INTO message_definitions VALUES(NULL, ?, ?, ?, ?)',
                    (topic.type_name, topic.encoding, topic.definition, topic.type_hash),
                )
            self._base.execute('COMMIT')

    def write(self, number: int, time_ns: int, _publish_ns: int, data: bytes) -> None:
        """Add a message; the format has no place for the time of publication."""
        stored = compress(data) if self._zstd else data
        with _as_os_error():
            self._begin()
            self._base.execute(
                'INSERT INTO messages VALUES(NULL, ?, ?, ?)', (number, time_ns, stored)
            )
        self._pending += len(stored)

    def flush(self) -> None:
        """Commit."""
        if not self._base.in_transaction:
            return
        require_room(self._path, 2 * self._pending)
        with _as_os_error():
            self._base.execute('COMMIT')
        self._committed, self._pending = self.size, 0

    def drop_pending(self) -> None:
        """Roll back."""
        if self._base.in_transaction:
            self._base.execute('ROLLBACK')
        self._pending = 0

    def finish(self, metadata: str) -> None:
        """Commit with the bag's summary."""
        self.flush()
        with _as_os_error():
            self._base.execute(
                'INSERT INTO metadata VALUES(NULL, ?, ?)', (METADATA_VERSION, metadata)
            )
            self._base.execute('PRAGMA journal_mode=DELETE')
        self.close()

    def close(self) -> None:
        """Close; what is not committed is gone."""
        self._base.close()

    def _begin(self) -> None:
        if not self._base.in_transaction:
            self._base.execute('BEGIN')


@contextmanager
def _as_os_error() -> Iterator[None]:
    try:
        yield
    except sqlite3.Error as error:
        full = 'full' in str(error)
        raise OSError(errno.ENOSPC if full else errno.EIO, str(error)) from error
