"""Repairing the bag of a recorder that was killed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from goalreach_bags.mcap_repair import McapScan, is_unborn_mcap, repair_mcap, scan_mcap
from goalreach_bags.metadata import BagMetadata, FileSpan, metadata_text, write_metadata
from goalreach_bags.reader import BagReader, storage_files
from goalreach_bags.sqlite_file import SqliteScan, is_unborn_sqlite, repair_sqlite, scan_sqlite
from goalreach_bags.topic import INFINITE_NS, BagError, BagTopic
from goalreach_bags.writer import FLUSH_S

_STORAGES: Final = {'.mcap': 'mcap', '.db3': 'sqlite3'}


@dataclass(frozen=True, kw_only=True)
class RepairResult:
    """What a repair found and did.

    Attributes:
        path: The bag.
        messages: Messages it now holds.
        duration_s: Time between the first and the last.
        repaired: Names of the files that had no end.
        dropped_bytes: Bytes of unfinished chunks that were cut off.
        was_sound: Whether there was nothing to do.
    """

    path: Path
    messages: int
    duration_s: float
    repaired: tuple[str, ...]
    dropped_bytes: int
    was_sound: bool

    def __str__(self) -> str:
        """Return it as one line."""
        holds = f'{self.messages} messages, {self.duration_s:.1f} s'
        if self.was_sound:
            return f'{self.path}: nothing to repair: {holds}'
        lost = f'{self.dropped_bytes} bytes of an unfinished chunk' if self.dropped_bytes else ''
        parts = [lost] if lost else []
        if self.repaired:
            parts.append(f'what the recorder had not written yet, {FLUSH_S:g} s at most')
        return f'{self.path}: repaired: {holds}; lost: {" and ".join(parts) or "nothing"}'


def repair_bag(path: Path) -> RepairResult:
    """Give a bag the summary and the indexes that it lacks.

    Args:
        path: Its directory.

    Raises:
        BagError: It is no bag, or holds nothing that could be repaired.
    """
    if not path.is_dir():
        raise BagError(path, 'is not a bag: a bag is a directory')
    files = storage_files(path)
    if not files:
        raise BagError(path, 'is not a bag: it holds no .mcap and no .db3 file')
    if len({file.suffix for file in files}) > 1:
        raise BagError(path, 'holds both .mcap and .db3 files')
    try:
        return _repair(path, files)
    except OSError as error:
        raise BagError(path, f'cannot be repaired: {error.strerror or error}') from None


def _repair(path: Path, files: list[Path]) -> RepairResult:
    if len(files) > 1 and _is_unborn(files[-1]):
        files.pop().unlink()  # the next file of a recorder that was killed while making it
    scans: list[McapScan | SqliteScan] = [
        scan_mcap(file) if file.suffix == '.mcap' else scan_sqlite(file) for file in files
    ]
    metadata = BagMetadata(
        storage=_STORAGES[files[0].suffix],
        topics=_topics(scans),
        files=tuple(_span(scan) for scan in scans),
        compression_mode='MESSAGE' if _compresses_messages(scans) else '',
    )
    broken = [scan for scan in scans if not scan.finished]
    total = metadata.total
    sound = not broken and _is_readable(path, total.message_count)
    dropped = 0
    for scan in scans:
        if isinstance(scan, SqliteScan):
            if not sound:
                repair_sqlite(scan, metadata_text(metadata), metadata.topics)
        elif not scan.finished:
            dropped += scan.size - scan.end
            repair_mcap(scan, metadata_text(metadata))
    if not sound:
        write_metadata(path, metadata)
        with BagReader(path) as bag:
            for _ in bag.messages():
                pass  # what cannot be read now is damaged beyond repair, and says so
    return RepairResult(
        path=path,
        messages=total.message_count,
        duration_s=total.duration_ns * 1e-9,
        repaired=tuple(scan.path.name for scan in broken),
        dropped_bytes=dropped,
        was_sound=sound,
    )


def _is_readable(path: Path, messages: int) -> bool:
    """Return whether a bag gives all its messages as it is."""
    try:
        with BagReader(path) as bag:
            return sum(1 for _ in bag.messages()) == messages
    except BagError:
        return False


def _is_unborn(file: Path) -> bool:
    return is_unborn_mcap(file) if file.suffix == '.mcap' else is_unborn_sqlite(file)


def _topics(scans: list[McapScan | SqliteScan]) -> tuple[BagTopic, ...]:
    topics: dict[str, BagTopic] = {}
    for scan in scans:
        found = scan.topics.values() if isinstance(scan, McapScan) else scan.topics
        for topic in found:
            known = topics.setdefault(topic.name, topic)
            if not known.type_hash:
                topics[topic.name] = replace(known, type_hash=topic.type_hash)
    return tuple(topics.values())


def _compresses_messages(scans: list[McapScan | SqliteScan]) -> bool:
    return any(isinstance(scan, SqliteScan) and scan.compressed for scan in scans)


def _span(scan: McapScan | SqliteScan) -> FileSpan:
    if isinstance(scan, SqliteScan):
        return scan.span
    filled = [chunk.info for chunk in scan.chunks if chunk.info.counts]
    return FileSpan(
        name=scan.path.name,
        counts=scan.counts(),
        first_ns=min((info.first_ns for info in filled), default=INFINITE_NS),
        last_ns=max((info.last_ns for info in filled), default=0),
    )
