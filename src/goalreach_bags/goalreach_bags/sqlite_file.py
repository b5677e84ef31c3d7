"""SQLite files of rosbag2: written as Jazzy does, read and repaired in every version."""

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
import errno
from functools import partial
from pathlib import Path
import shutil
import sqlite3
from tempfile import TemporaryDirectory
from typing import Final

from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer
import zstandard

from goalreach_bags.metadata import METADATA_VERSION, ROS_DISTRO
from goalreach_bags.storage import (
    NO_TIME_NS,
    NOT_CLOSED,
    ZSTD_LEVEL,
    ZSTD_MAGIC,
    BagError,
    FileSpan,
    StorageScan,
    StoredMessage,
)
from goalreach_bags.topic import BagTopic, offers_to_text, parse_offers

_FIRST_TABLES: Final = {'schema', 'metadata', 'topics', 'message_definitions'}
"""Tables that are created before the one for messages."""


class SqliteWriter:
    """Writes one new SQLite file of a bag, with the methods of `McapWriter`.

    What is appended survives if the process is killed. Every method may raise OSError.

    Attributes:
        size: Bytes of messages so far.
        closing_bytes: 0: what the file needs to be closed is not worth an estimate.
    """

    def __init__(self, path: Path, *, zstd: bool) -> None:
        self._zstd = zstd
        self._types: set[str] = set()
        self._topics: dict[str, int | None] = {}
        self.size = self.closing_bytes = 0
        with _as_os_error():
            self._base = sqlite3.connect(path)
            # The journal keeps a killed process's file sound; only a power cut needs the waiting.
            self._base.execute('PRAGMA synchronous=OFF')
            self._base.execute('PRAGMA journal_mode=TRUNCATE')
            self._base.executescript(f'BEGIN; {Sqlite3Writer.SQLITE_SCHEMA} COMMIT')
            with self._base:
                self._base.execute('UPDATE schema SET ros_distro = ?', (ROS_DISTRO,))

    def add_topic(self, topic: BagTopic) -> None:
        """Add a topic and the definition of its type."""
        offers = offers_to_text(topic.offers)
        row = (topic.name, topic.type_name, 'cdr', offers, topic.type_hash)
        with _as_os_error(), self._base:
            added = self._base.execute('INSERT INTO topics VALUES(NULL, ?, ?, ?, ?, ?)', row)
            self._topics[topic.name] = added.lastrowid
            if topic.type_name not in self._types:
                self._types.add(topic.type_name)
                self._base.execute(
                    'INSERT INTO message_definitions VALUES(NULL, ?, ?, ?, ?)',
                    (topic.type_name, topic.encoding, topic.definition, topic.type_hash),
                )

    def append(self, messages: Sequence[StoredMessage]) -> None:
        """Write messages; the format has no place for the time of publication."""
        rows = [
            (self._topics[topic], at, zstandard.compress(data, ZSTD_LEVEL) if self._zstd else data)
            for topic, at, _, data in messages
        ]
        with _as_os_error(), self._base:
            self._base.executemany('INSERT INTO messages VALUES(NULL, ?, ?, ?)', rows)
        self.size += sum(len(data) for _, _, data in rows)

    def finish(self, metadata: str) -> None:
        """Write the bag's metadata."""
        with _as_os_error():
            with self._base:
                _add_metadata(self._base, metadata)
            self._base.execute('PRAGMA journal_mode=DELETE')
        self.close()

    def close(self) -> None:
        """Close the file as it is."""
        self._base.close()


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
    """Reads one SQLite file, as `McapReader`; never changes the file."""

    def __init__(self, path: Path, opened: ExitStack) -> None:
        self._base = opened.enter_context(closing(_connect(path, 'immutable=1')))
        self._topics = _read_topics(self._base)
        self.topics = tuple(self._topics.values())
        self.span = _read_span(path.name, self._base, self._topics)

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
    counts: Counter[str] = Counter()
    for number, count in rows:
        if number in topics:
            counts[topics[number].name] += count
    times = base.execute('SELECT MIN(timestamp), MAX(timestamp) FROM messages').fetchone()
    first_ns = NO_TIME_NS if times[0] is None else times[0]
    return FileSpan(name=name, counts=counts, first_ns=first_ns, last_ns=times[1] or 0)


def _columns(base: sqlite3.Connection, table: str) -> set[str]:
    """Return the names of a table's columns; none where there is no such table."""
    return {row[1] for row in base.execute(f'PRAGMA table_info({table})')}


class SqliteScan(StorageScan):
    """Result of reading an SQLite file whole; SQLite itself undoes what was not committed."""

    def write_repaired(self, target: Path, metadata: str) -> None:
        """Copy the file, rebuild the indexes of the copy and add the bag's metadata.

        Offers that are damaged are removed: other readers refuse the whole file for them.
        """
        opened = closing(sqlite3.connect(target))
        with _as_os_error(), opened as base, _recovered(self.path) as source:
            source.backup(base)
        with _as_os_error(), closing(sqlite3.connect(target)) as base, base:
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
    """Read a file whole, as SQLite recovers it after its writer was killed.

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


def journals_of(path: Path) -> list[Path]:
    """Return the files beside an SQLite file in which a killed process may have left messages."""
    return [path.with_name(f'{path.name}{ending}') for ending in ('-journal', '-wal', '-shm')]


@contextmanager
def _recovered(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a file; one with the journal of a killed process is recovered on a copy."""
    journals = [file for file in journals_of(path) if file.exists() and file.stat().st_size]
    with ExitStack() as stack:
        source, mode = path, 'mode=ro'
        if journals:
            folder = stack.enter_context(TemporaryDirectory(dir=path.parent, prefix='.repair-'))
            source, mode = Path(folder) / path.name, 'mode=rw'
            for file in (path, *journals):
                shutil.copyfile(file, source.with_name(file.name))
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
        problems=dict.fromkeys(_problems(path, base, closed=bool(metadata))),
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


def _problems(path: Path, base: sqlite3.Connection, *, closed: bool) -> Iterator[str]:
    journal = any(file.exists() for file in journals_of(path))
    if journal or (not closed and _columns(base, 'metadata')):
        yield NOT_CLOSED
    if base.execute('PRAGMA integrity_check(1)').fetchone()[0] != 'ok':
        yield 'its index does not match its messages'
    if 'offered_qos_profiles' in _columns(base, 'topics'):
        texts = [text for (text,) in base.execute('SELECT offered_qos_profiles FROM topics')]
        if any(text.strip() not in ('', '[]') and not parse_offers(text) for text in texts):
            yield 'its quality of service is damaged'


def is_truncated_database(path: Path) -> bool:
    """Return whether a file was created for a bag, but has no table of messages yet."""
    try:
        with _recovered(path) as base:
            rows = base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
            return {name for (name,) in rows} <= _FIRST_TABLES
    except sqlite3.Error:
        return False
