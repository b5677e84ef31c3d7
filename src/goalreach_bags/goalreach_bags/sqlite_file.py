"""SQLite files of rosbag2: written as Jazzy does, read and repaired in every version."""

from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
import errno
from functools import partial
from pathlib import Path
import shutil
import sqlite3
from tempfile import TemporaryDirectory
from typing import Any, Final

import zstandard

from goalreach_bags.metadata import METADATA_VERSION, ROS_DISTRO
from goalreach_bags.storage import (
    NO_TIME_NS,
    NOT_CLOSED,
    ZSTD_LEVEL,
    ZSTD_MAGIC,
    BagError,
    FileSpan,
    require_free_space,
)
from goalreach_bags.topic import BagTopic, offers_to_text, parse_offers

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
_FIRST_TABLES: Final = {'schema', 'metadata', 'topics', 'message_definitions'}
"""Tables that are created before the one for messages."""

_COMMIT_BYTES: Final = 4 * 1024 * 1024
"""Buffered messages are committed at this size. Chosen."""


class SqliteWriter:
    """One SQLite file of a bag being written, with the methods of `McapWriter`.

    What is committed survives the death of the process. Every method may raise OSError.

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
        """Whether enough is buffered for a commit."""
        return self._pending >= _COMMIT_BYTES

    def add_topic(self, number: int, topic: BagTopic) -> None:
        """Add a topic and the definition of its type."""
        offers = offers_to_text(topic.offers)
        row = (number, topic.name, topic.type_name, 'cdr', offers, topic.type_hash)
        self._execute('INSERT INTO topics VALUES(?, ?, ?, ?, ?, ?)', row)
        if topic.type_name not in self._types:
            self._types.add(topic.type_name)
            self._execute(
                'INSERT INTO message_definitions VALUES(NULL, ?, ?, ?, ?)',
                (topic.type_name, topic.encoding, topic.definition, topic.type_hash),
            )
        self._execute('COMMIT')

    def write(self, number: int, time_ns: int, _publish_ns: int, data: bytes) -> None:
        """Add a message; the format has no place for the time of publication."""
        stored = zstandard.compress(data, ZSTD_LEVEL) if self._zstd else data
        self._execute('INSERT INTO messages VALUES(NULL, ?, ?, ?)', (number, time_ns, stored))
        self._pending += len(stored)

    def flush(self) -> None:
        """Commit."""
        if self._base.in_transaction:
            require_free_space(self._path, 2 * self._pending)
            self._execute('COMMIT')
            self._committed, self._pending = self.size, 0

    def drop_pending(self) -> None:
        """Roll back."""
        if self._base.in_transaction:
            self._base.execute('ROLLBACK')
        self._pending = 0

    def finish(self, metadata: str) -> None:
        """Commit with the bag's metadata."""
        self.flush()
        with _as_os_error():
            _add_metadata(self._base, metadata)
            self._base.execute('PRAGMA journal_mode=DELETE')
        self.close()

    def close(self) -> None:
        """Close without a commit."""
        self._base.close()

    def _execute(self, statement: str, values: tuple[Any, ...] = ()) -> None:
        with _as_os_error():
            if not self._base.in_transaction:
                self._base.execute('BEGIN')
            self._base.execute(statement, values)


@contextmanager
def _as_os_error() -> Iterator[None]:
    try:
        yield
    except sqlite3.Error as error:
        full = 'full' in str(error)
        raise OSError(errno.ENOSPC if full else errno.EIO, str(error)) from error


def _add_metadata(base: sqlite3.Connection, metadata: str) -> None:
    base.execute('INSERT INTO metadata VALUES(NULL, ?, ?)', (METADATA_VERSION, metadata))


class SqliteReader:
    """One SQLite file open for reading, with the methods of `McapReader`; never changes the file.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self._base = _connect(path, 'immutable=1')
        try:
            self._topics = _read_topics(self._base)
            self.topics = tuple(self._topics.values())
            self.span = _read_span(path.name, self._base, self._topics)
        except BaseException:
            self._base.close()
            raise

    def messages(
        self, topics: Collection[str], start_ns: int | None, stop_ns: int | None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, receive time and data in the order of receive time; see `McapReader`."""
        names = {n: topic.name for n, topic in self._topics.items() if topic.name in topics}
        first_ns = 0 if start_ns is None else start_ns
        last_ns = NO_TIME_NS if stop_ns is None else stop_ns - 1
        rows = self._base.execute(
            'SELECT topic_id, timestamp, data FROM messages '  # noqa: S608 - numbers
            f'WHERE topic_id IN ({", ".join(map(str, names))}) '
            'AND timestamp BETWEEN ? AND ? ORDER BY timestamp',
            (first_ns, last_ns),
        )
        for number, time_ns, data in rows:
            yield names[number], time_ns, data

    def close(self) -> None:
        """Close it."""
        self._base.close()


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    """Open a file; texts that are damaged lose the damaged characters."""
    base = sqlite3.connect(f'{path.absolute().as_uri()}?{mode}', uri=True)
    base.text_factory = partial(str, encoding='utf-8', errors='replace')
    return base


def _read_topics(base: sqlite3.Connection) -> dict[int, BagTopic]:
    """Return the topics by number; older versions have no offers, hashes or definitions."""
    definitions = {}
    if _columns(base, 'message_definitions'):
        rows = base.execute(
            'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
        )
        definitions = {name: (encoding, text) for name, encoding, text in rows}
    columns = ['id', 'name', 'type', 'serialization_format']
    optional = ('offered_qos_profiles', 'type_description_hash')
    known = _columns(base, 'topics')
    columns += [name if name in known else f"'' AS {name}" for name in optional]
    topics = {}
    rows = base.execute(f'SELECT {", ".join(columns)} FROM topics ORDER BY id')  # noqa: S608
    for number, name, type_name, serialization, offers, type_hash in rows:
        encoding, text = definitions.get(type_name, ('ros2msg', ''))
        topics[int(number)] = BagTopic(
            name=str(name),
            type_name=str(type_name),
            type_hash=str(type_hash),
            offers=parse_offers(offers),
            definition=text,
            encoding=encoding,
            serialization=serialization,
        )
    return topics


def _read_span(name: str, base: sqlite3.Connection, topics: dict[int, BagTopic]) -> FileSpan:
    rows = base.execute('SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id')
    counts = Counter({topics[number].name: n for number, n in rows if number in topics})
    times = base.execute('SELECT MIN(timestamp), MAX(timestamp) FROM messages').fetchone()
    first_ns = NO_TIME_NS if times[0] is None else times[0]
    return FileSpan(name=name, counts=counts, first_ns=first_ns, last_ns=times[1] or 0)


def _columns(base: sqlite3.Connection, table: str) -> set[str]:
    """Return the names of a table's columns; none where there is no such table."""
    return {row[1] for row in base.execute(f'PRAGMA table_info({table})')}


@dataclass(frozen=True, kw_only=True)
class SqliteScan:
    """Result of reading an SQLite file whole, with the methods of `McapScan`.

    Attributes:
        path: The file.
        topics: Its topics.
        span: Its messages.
        damage: Why the file needs repair; empty for a sound file.
        compressed: Whether each message is compressed.
        metadata: Copy of the bag's metadata, or empty.
        distro: ROS distribution, or empty.
        indexed: True.
        dropped_bytes: None: SQLite itself undoes what was not committed.
    """

    path: Path
    topics: tuple[BagTopic, ...]
    span: FileSpan
    damage: str
    compressed: bool
    metadata: str
    distro: str
    indexed: bool = True
    dropped_bytes: int = 0

    def write_repaired(self, target: Path, metadata: str) -> None:
        """Copy the file, rebuild the indexes of the copy and add the bag's metadata.

        Offers that are damaged are removed: other readers refuse the whole file for them.

        Raises:
            OSError: The copy cannot be written.
        """
        with _as_os_error(), closing(sqlite3.connect(target)) as base, base:
            with _recovered(self.path) as source:
                source.backup(base)
            base.execute('PRAGMA journal_mode=DELETE')
            base.execute('REINDEX')
            if _columns(base, 'metadata'):
                base.execute('DELETE FROM metadata')
                _add_metadata(base, metadata)
            if 'offered_qos_profiles' in _columns(base, 'topics'):
                base.executemany(
                    'UPDATE topics SET offered_qos_profiles = ? WHERE name = ?',
                    [(offers_to_text(topic.offers), topic.name) for topic in self.topics],
                )


def scan_sqlite(path: Path) -> SqliteScan:
    """Read a file whole, as SQLite recovers it from the death of its writer.

    Raises:
        BagError: It is no such file, or cannot be recovered.
    """
    try:
        with _recovered(path) as base:
            return _scan(path, base)
    except sqlite3.Error as error:
        raise BagError(path, f'is no SQLite file of a bag: {error}') from None
    except (ValueError, TypeError, AttributeError, KeyError) as error:
        raise BagError(path, f'is damaged: {type(error).__name__}, {error}') from None


@contextmanager
def _recovered(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a file; one with the journal of a killed process is recovered on a copy."""
    journal = path.with_name(f'{path.name}-journal')
    with ExitStack() as stack:
        source, mode = path, 'mode=ro'
        if journal.exists() and journal.stat().st_size:
            folder = stack.enter_context(TemporaryDirectory(dir=path.parent, prefix='.repair-'))
            source, mode = Path(folder) / path.name, 'mode=rw'
            shutil.copyfile(path, source)
            shutil.copyfile(journal, source.with_name(journal.name))
        yield stack.enter_context(closing(_connect(source, mode)))


def _scan(path: Path, base: sqlite3.Connection) -> SqliteScan:
    (answer,) = base.execute('PRAGMA quick_check(1)').fetchone()
    if answer != 'ok':
        raise BagError(path, f'is damaged beyond repair: {answer}')
    topics = _read_topics(base)
    sample = base.execute('SELECT data FROM messages LIMIT 1').fetchone()
    metadata = _last(base, 'metadata', 'metadata')
    return SqliteScan(
        path=path,
        topics=tuple(topics.values()),
        span=_read_span(path.name, base, topics),
        damage=_damage(path, base, closed=bool(metadata)),
        compressed=bool(sample) and bytes(sample[0][:4]) == ZSTD_MAGIC,
        metadata=metadata,
        distro=_last(base, 'schema', 'ros_distro'),
    )


def _last(base: sqlite3.Connection, table: str, column: str) -> str:
    """Return the text in the last row of a table; empty where there is none."""
    if column not in _columns(base, table):
        return ''
    rows = base.execute(f'SELECT {column} FROM {table}').fetchall()  # noqa: S608 - our names
    return str(rows[-1][0]) if rows else ''


def _damage(path: Path, base: sqlite3.Connection, *, closed: bool) -> str:
    if path.with_name(f'{path.name}-journal').exists() or (
        not closed and _columns(base, 'metadata')
    ):
        return NOT_CLOSED
    if base.execute('PRAGMA integrity_check(1)').fetchone()[0] != 'ok':
        return 'its index does not match its messages'
    if 'offered_qos_profiles' in _columns(base, 'topics'):
        texts = [text for (text,) in base.execute('SELECT offered_qos_profiles FROM topics')]
        if any(text.strip() not in ('', '[]') and not parse_offers(text) for text in texts):
            return 'its quality of service is damaged'
    return ''


def is_truncated_database(path: Path) -> bool:
    """Return whether a file was created for a bag, but has no table of messages yet."""
    try:
        with _recovered(path) as base:
            rows = base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
            tables = {name for (name,) in rows}
    except sqlite3.Error:
        return False
    return 'messages' not in tables and tables <= _FIRST_TABLES
