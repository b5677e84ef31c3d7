"""Reading what is in the SQLite file of a bag, and giving it its summary."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
import sqlite3
from typing import Final

from goalreach_bringup.bags.errors import BagError
from goalreach_bringup.bags.metadata import METADATA_VERSION, FileSpan
from goalreach_bringup.bags.topic import INFINITE_NS, BagTopic, offers_to_text, parse_offers

__all__ = ['SqliteScan', 'is_unborn_sqlite', 'repair_sqlite', 'scan_sqlite']

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
