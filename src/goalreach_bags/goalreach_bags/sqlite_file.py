"""Writing one SQLite file with the tables of Jazzy's rosbag2."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
import errno
from pathlib import Path
import sqlite3
from typing import Final

from goalreach_bags.metadata import METADATA_VERSION, ROS_DISTRO, FileSpan
from goalreach_bags.topic import (
    INFINITE_NS,
    BagError,
    BagTopic,
    compress,
    offers_to_text,
    parse_offers,
    require_room,
)

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


_CHECK_ALL: Final = 'PRAGMA integrity_check(1)'
_ZSTD_MAGIC: Final = b'\x28\xb5\x2f\xfd'


_FIRST_TABLES = {'schema', 'metadata', 'topics', 'message_definitions'}
"""What a bag's file holds before its table of messages, which is made last."""


@dataclass(frozen=True, kw_only=True)
class SqliteScan:
    """What was found in a file.

    Attributes:
        path: The file.
        topics: Its topics.
        span: Its messages.
        finished: Whether it holds a summary, and indexes that fit its messages.
        compressed: Whether its messages are.
    """

    path: Path
    topics: tuple[BagTopic, ...]
    span: FileSpan
    finished: bool
    compressed: bool


def is_unborn_sqlite(path: Path) -> bool:
    """Return whether a file is the beginning of a bag's that got no further than its tables."""
    try:
        with closing(sqlite3.connect(path)) as base:
            rows = base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
            tables = {name for (name,) in rows}
    except sqlite3.Error:
        return False
    return 'messages' not in tables and tables <= _FIRST_TABLES


def scan_sqlite(path: Path) -> SqliteScan:
    """Return what is in a file; SQLite itself undoes what a killed process left half done.

    Raises:
        BagError: It is no such file, or damaged beyond that.
    """
    try:
        with closing(sqlite3.connect(path)) as base:
            (answer,) = base.execute('PRAGMA quick_check(1)').fetchone()
            if answer != 'ok':
                raise BagError(path, f'is damaged beyond repair: {answer}')
            return _scan(path, base, indexed=base.execute(_CHECK_ALL).fetchone()[0] == 'ok')
    except sqlite3.Error as error:
        raise BagError(path, f'is no SQLite file of a bag: {error}') from None
    except (ValueError, TypeError, AttributeError, KeyError) as error:
        raise BagError(path, f'is damaged: {type(error).__name__}, {error}') from None


def _scan(path: Path, base: sqlite3.Connection, *, indexed: bool) -> SqliteScan:
    definitions = {
        name: (encoding, text)
        for name, encoding, text in base.execute(
            'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
        )
    }
    topics, names = [], {}
    rows = base.execute(
        'SELECT id, name, type, offered_qos_profiles, type_description_hash FROM topics'
    )
    for number, name, type_name, offers, type_hash in rows:
        encoding, text = definitions.get(type_name, ('ros2msg', ''))
        names[number] = name
        topics.append(
            BagTopic(
                name=name,
                type_name=type_name,
                type_hash=type_hash,
                offers=parse_offers(offers),
                definition=text,
                encoding=encoding,
            )
        )
    rows = base.execute('SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id')
    counts = {names[number]: count for number, count in rows if number in names}
    first_ns, last_ns = base.execute(
        'SELECT MIN(timestamp), MAX(timestamp) FROM messages'
    ).fetchone()
    sample = base.execute('SELECT data FROM messages LIMIT 1').fetchone()
    return SqliteScan(
        path=path,
        topics=tuple(topics),
        span=FileSpan(
            name=path.name,
            counts=counts,
            first_ns=INFINITE_NS if first_ns is None else first_ns,
            last_ns=last_ns or 0,
        ),
        finished=indexed and bool(base.execute('SELECT COUNT(*) FROM metadata').fetchone()[0]),
        compressed=bool(sample) and bytes(sample[0][:4]) == _ZSTD_MAGIC,
    )


def repair_sqlite(scan: SqliteScan, metadata: str, topics: Iterable[BagTopic]) -> None:
    """Make the indexes anew and add the bag's summary.

    A reader that finds other offers in a file than in the summary takes the topics for different
    ones, and gives none of their messages.

    Args:
        scan: The file.
        metadata: The summary.
        topics: The topics in the summary.

    Raises:
        OSError: The file cannot be written.
    """
    try:
        with closing(sqlite3.connect(scan.path)) as base, base:
            base.execute('REINDEX')
            base.executemany(
                'UPDATE topics SET offered_qos_profiles = ? WHERE name = ?',
                [(offers_to_text(topic.offers), topic.name) for topic in topics],
            )
            base.execute('DELETE FROM metadata')
            base.execute('INSERT INTO metadata VALUES(NULL, ?, ?)', (METADATA_VERSION, metadata))
    except sqlite3.Error as error:
        raise OSError(str(error)) from error
