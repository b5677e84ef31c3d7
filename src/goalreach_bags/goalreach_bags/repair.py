"""Repair of bags whose recorder was killed, without harm to any file."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from goalreach_bags.mcap_repair import McapScan, is_truncated_header, scan_mcap
from goalreach_bags.metadata import (
    METADATA_NAME,
    BagMetadata,
    metadata_text,
    parse_metadata,
    total_span,
    write_metadata,
)
from goalreach_bags.reader import BagReader, storage_files
from goalreach_bags.sqlite_file import SqliteScan, is_truncated_database, scan_sqlite
from goalreach_bags.storage import NOT_CLOSED, SUFFIXES, BagError
from goalreach_bags.topic import merge_topics
from goalreach_bags.writer import FLUSH_S

_STORAGES: Final = {suffix: storage for storage, suffix in SUFFIXES.items()}
_StorageScan = McapScan | SqliteScan
_JOURNAL: Final = '-journal'


@dataclass(frozen=True, kw_only=True)
class RepairResult:
    """Result of a repair.

    Attributes:
        path: The bag.
        messages: Messages that it now holds.
        duration_s: Time between the first and the last.
        damage: What was wrong with each file that was damaged, by its name.
        dropped_bytes: Bytes of unfinished or damaged records that were left out.
        was_sound: Whether nothing had to be done.
    """

    path: Path
    messages: int
    duration_s: float
    damage: dict[str, str]
    dropped_bytes: int
    was_sound: bool

    def __str__(self) -> str:
        """Return it as one line."""
        holds = f'{self.messages} messages, {self.duration_s:.1f} s'
        if self.was_sound:
            return f'{self.path}: nothing to repair: {holds}'
        lost = []
        if self.dropped_bytes:
            lost.append(f'{self.dropped_bytes} bytes of unfinished or damaged records')
        if NOT_CLOSED in self.damage.values():
            lost.append(f'messages not written yet, of the last {FLUSH_S:g} s')
        found = ''.join(f'; {name}: {problem}' for name, problem in self.damage.items())
        return f'{self.path}: repaired: {holds}; lost: {" and ".join(lost) or "nothing"}{found}'


def repair_bag(path: Path, *, replace_files: bool = False) -> RepairResult:
    """Write damaged files of a bag again, and its metadata where that is missing or wrong.

    A sound file is left untouched. A damaged one is kept as `NAME.damaged`.

    Args:
        path: The bag's directory.
        replace_files: Whether to delete damaged files once they are repaired.

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
        return _repair(path, files, replace_files=replace_files)
    except OSError as error:
        raise BagError(path, f'cannot be repaired: {error.strerror or error}') from None


def _repair(path: Path, files: list[Path], *, replace_files: bool) -> RepairResult:
    # The recorder may have been killed while it began its next file.
    empty = [files.pop()] if len(files) > 1 and _is_truncated(files[-1]) else []
    scans: list[_StorageScan] = [
        scan_mcap(file) if file.suffix == '.mcap' else scan_sqlite(file) for file in files
    ]
    existing = _existing_metadata(path)
    metadata = _metadata(path, scans, existing)
    damaged = [scan for scan in scans if scan.damage]
    was_sound = not damaged and not empty and existing is not None and _agree(existing, metadata)
    if not was_sound:
        aside = [*empty, *(scan.path for scan in damaged)]
        if (path / METADATA_NAME).exists():
            aside.append(path / METADATA_NAME)
        _require_free_names(path, aside)
        _write_repaired(damaged, metadata_text(metadata))
        for file in aside:
            _move(file, file.with_name(f'{file.name}.damaged'))
        for scan in damaged:
            _repaired(scan.path).rename(scan.path)
        write_metadata(path, metadata)
        with BagReader(path) as bag:
            deque(bag.messages(), maxlen=0)  # reads them all
        for file in aside if replace_files else ():
            file.with_name(f'{file.name}.damaged').unlink()
            file.with_name(f'{file.name}.damaged{_JOURNAL}').unlink(missing_ok=True)
    return RepairResult(
        path=path,
        messages=metadata.total.message_count,
        duration_s=metadata.total.duration_ns * 1e-9,
        damage={scan.path.name: scan.damage for scan in damaged},
        dropped_bytes=sum(scan.dropped_bytes for scan in scans),
        was_sound=was_sound,
    )


def _write_repaired(scans: list[_StorageScan], metadata: str) -> None:
    """Write the repaired files, all or none."""
    try:
        for scan in scans:
            scan.write_repaired(_repaired(scan.path), metadata)
    except BaseException:
        for scan in scans:
            _repaired(scan.path).unlink(missing_ok=True)
        raise


def _is_truncated(file: Path) -> bool:
    return is_truncated_header(file) if file.suffix == '.mcap' else is_truncated_database(file)


def _existing_metadata(path: Path) -> BagMetadata | None:
    """Return the contents of metadata.yaml; None where it is missing or damaged.

    Raises:
        BagError: It is of a newer version, which a repair would lose.
    """
    if not (path / METADATA_NAME).exists():
        return None
    text = (path / METADATA_NAME).read_text(encoding='utf-8', errors='replace')
    return parse_metadata(path, text)


def _metadata(path: Path, scans: list[_StorageScan], existing: BagMetadata | None) -> BagMetadata:
    """Return metadata for the contents of the files, with all that only older metadata says."""
    copies = [parse_metadata(path, scan.metadata) for scan in scans]
    known = [metadata for metadata in (existing, *reversed(copies)) if metadata is not None]
    custom: dict[str, str] = {}
    for metadata in reversed(known):
        custom.update(metadata.custom)
    compressed = any(scan.compressed for scan in scans)
    distros = [*(m.distro for m in known), *(scan.distro for scan in scans)]
    spans = tuple(scan.span for scan in scans)
    topics = merge_topics(topic for source in (*scans, *known) for topic in source.topics)
    return BagMetadata(
        storage=_STORAGES[scans[0].path.suffix],
        topics=tuple(topics.values()),
        files=spans,
        total=total_span(spans),
        compression_mode='MESSAGE' if compressed else '',
        custom=custom,
        distro=next(filter(None, distros), ''),
    )


def _agree(existing: BagMetadata, metadata: BagMetadata) -> bool:
    """Return whether metadata.yaml describes what the files hold."""
    mine, found = existing.total, metadata.total
    return (
        [file.name for file in existing.files] == [file.name for file in metadata.files]
        and {name: n for name, n in mine.counts.items() if n} == dict(found.counts)
        and (not found.counts or (mine.first_ns, mine.last_ns) == (found.first_ns, found.last_ns))
        and existing.storage == metadata.storage
        and existing.compression_mode == metadata.compression_mode
    )


def _repaired(file: Path) -> Path:
    return file.with_name(f'{file.name}.repaired')


def _require_free_names(path: Path, files: list[Path]) -> None:
    for file in files:
        for ending in ('.damaged', '.repaired'):
            if file.with_name(f'{file.name}{ending}').exists():
                problem = f'holds {file.name}{ending} of an earlier repair: move it away first'
                raise BagError(path, problem)


def _move(file: Path, target: Path) -> None:
    """Rename a file, with its SQLite journal if there is one."""
    journal = file.with_name(f'{file.name}{_JOURNAL}')
    if journal.exists():
        journal.rename(target.with_name(f'{target.name}{_JOURNAL}'))
    file.rename(target)
