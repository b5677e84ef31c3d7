"""Inspection of a bag: contents and faults of its files; and repair that keeps every file."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from goalreach_bags.mcap_repair import MAGIC, scan_mcap
from goalreach_bags.metadata import (
    METADATA_NAME,
    METADATA_VERSION,
    BagMetadata,
    metadata_text,
    parse_metadata,
    total_span,
    write_metadata,
)
from goalreach_bags.sqlite_file import is_truncated_database, journals_of, scan_sqlite
from goalreach_bags.storage import NOT_CLOSED, SUFFIXES, BagError, StorageScan, storage_files
from goalreach_bags.topic import merge_topics
from goalreach_bags.writer import FLUSH_S

_STORAGES: Final = {suffix: storage for storage, suffix in SUFFIXES.items()}


@dataclass(frozen=True, kw_only=True)
class BagScan:
    """Result of reading all files of a bag whole.

    Attributes:
        path: The bag.
        files: Its storage files, read whole.
        unfinished: Files that the recorder had only begun.
        existing: Contents of metadata.yaml; None where it is missing or damaged.
        metadata: Contents that it should have.
    """

    path: Path
    files: Sequence[StorageScan]
    unfinished: Sequence[Path]
    existing: BagMetadata | None
    metadata: BagMetadata

    @property
    def damage(self) -> dict[str, str]:
        """What is wrong with each damaged file, by its name; a repair writes it again."""
        return {file.path.name: file.damage for file in self.files if file.damage}

    @property
    def problems(self) -> tuple[str, ...]:
        """Faults of the bag, in the terms of its formats; none for a sound one."""
        damages = [f'{name}: {damage}' for name, damage in self.damage.items()]
        damages += [f'{file.name}: ends within its first bytes' for file in self.unfinished]
        wrong = _disagreements(self.existing, self.metadata)
        return tuple(damages or [f'{METADATA_NAME}: {text}' for text in wrong])

    @property
    def is_newer(self) -> bool:
        """Whether the metadata is of a version newer than is known here."""
        return self.existing is not None and self.existing.version > METADATA_VERSION

    @property
    def messages(self) -> int:
        """Number of sound messages."""
        return self.metadata.total.message_count

    @property
    def was_sound(self) -> bool:
        """Whether there is nothing to repair."""
        return not self.problems

    def __str__(self) -> str:
        """Return the result of a repair in one line."""
        total = self.metadata.total
        holds = f'{total.message_count} messages, {total.duration_ns * 1e-9:.1f} s'
        if self.was_sound:
            return f'{self.path}: nothing to repair: {holds}'
        lost = []
        if dropped_bytes := sum(file.dropped_bytes for file in self.files):
            lost.append(f'{dropped_bytes} bytes of unfinished or damaged records')
        if any(NOT_CLOSED in problem for problem in self.damage.values()):
            lost.append(f'messages not written yet, of the last {FLUSH_S:g} s')
        found = ''.join(f'; {name}: {problem}' for name, problem in self.damage.items())
        return f'{self.path}: repaired: {holds}; lost: {" and ".join(lost) or "nothing"}{found}'


def scan_bag(path: Path) -> BagScan:
    """Read all files of a bag whole.

    Raises:
        BagError: It is no bag, or holds nothing that could be repaired.
        OSError: A file cannot be read.
    """
    if not path.is_dir():
        raise BagError(path, 'is not a bag: a bag is a directory')
    files = storage_files(path)
    if not files:
        raise BagError(path, 'is not a bag: it holds no .mcap and no .db3 file')
    if len({file.suffix for file in files}) > 1:
        raise BagError(path, 'holds both .mcap and .db3 files')
    # The recorder may have been killed while it began its next file.
    unfinished = [files.pop()] if len(files) > 1 and _is_truncated(files[-1]) else []
    scans: list[StorageScan] = [
        scan_mcap(file) if file.suffix == '.mcap' else scan_sqlite(file) for file in files
    ]
    file = path / METADATA_NAME
    text = file.read_text(encoding='utf-8', errors='replace') if file.exists() else ''
    existing = parse_metadata(text)
    metadata = _metadata(scans, existing)
    return BagScan(
        path=path, files=scans, unfinished=unfinished, existing=existing, metadata=metadata
    )


def _is_truncated(file: Path) -> bool:
    if file.suffix != '.mcap':
        return is_truncated_database(file)
    return file.stat().st_size < len(MAGIC) and MAGIC.startswith(file.read_bytes())


def _metadata(scans: Sequence[StorageScan], existing: BagMetadata | None) -> BagMetadata:
    """Return metadata for the contents of the files, with all that only older metadata says."""
    copies = [parse_metadata(scan.metadata) for scan in scans]
    known = [metadata for metadata in (existing, *reversed(copies)) if metadata is not None]
    distros = [*(m.distro for m in known), *(scan.distro for scan in scans)]
    spans = tuple(scan.span for scan in scans)
    sources: list[StorageScan | BagMetadata] = [*scans, *known]
    topics = merge_topics(topic for source in sources for topic in source.topics)
    return BagMetadata(
        storage=_STORAGES[scans[0].path.suffix],
        topics=tuple(topics.values()),
        files=spans,
        total=total_span(spans),
        compression_mode='MESSAGE' if any(scan.compressed for scan in scans) else '',
        custom={key: text for one in reversed(known) for key, text in one.custom.items()},
        distro=next(filter(None, distros), ''),
    )


def _disagreements(existing: BagMetadata | None, metadata: BagMetadata) -> Iterator[str]:
    """Yield what metadata.yaml says of the files that is not so."""
    if existing is None:
        yield 'is missing, or not the metadata of a bag'
        return
    mine, found = existing.total, metadata.total
    for name in sorted(mine.counts.keys() | found.counts.keys()):
        if mine.counts[name] != found.counts[name]:
            hold = f'the files hold {found.counts[name]}'
            yield f'counts {mine.counts[name]} messages of {name}, {hold}'
    if found.counts and (mine.first_ns, mine.last_ns) != (found.first_ns, found.last_ns):
        yield 'its times are not those of the messages'
    if [file.name for file in existing.files] != [file.name for file in metadata.files]:
        yield 'names other files than there are'
    if existing.storage != metadata.storage:
        yield f'names the storage plug-in {existing.storage!r}'
    if found.counts and existing.compression_mode != metadata.compression_mode:
        yield f'names the compression mode {existing.compression_mode!r}'


def inspect_bag(path: Path) -> tuple[tuple[str, ...], str]:
    """Read a bag whole; return its faults, and how to repair them where a repair helps."""
    if not storage_files(path) and any(path.glob('*.zstd')):
        return (), 'not checked: its files are compressed as a whole'
    try:
        scan = scan_bag(path)
    except BagError as error:
        name = '' if error.path == str(path) else f'{Path(error.path).name}: '
        return (f'{name}{error.reason}',), ''
    except OSError as error:
        return (str(error),), ''
    if scan.problems:
        advice = '' if scan.is_newer else f'repair it: goalreach record --repair {path}'
        return scan.problems, advice
    unindexed = ', '.join(file.path.name for file in scan.files if not file.indexed)
    return (), f'{unindexed}: no index, so it is read from its beginning' if unindexed else ''


def repair_bag(path: Path, *, replace_files: bool = False) -> BagScan:
    """Write damaged files of a bag again, and its metadata where that is missing or wrong.

    A sound file is left untouched. A damaged one is kept as `NAME.damaged`.

    Args:
        path: The bag's directory.
        replace_files: Whether to delete damaged files once they are repaired.

    Returns:
        What was found, and is now in order.

    Raises:
        BagError: It is no bag, or holds nothing that could be repaired.
    """
    try:
        scan = scan_bag(path)
        if not scan.was_sound:
            _repair(scan, replace_files=replace_files)
    except OSError as error:
        raise BagError(path, f'cannot be repaired: {error.strerror or error}') from None
    return scan


def _repair(scan: BagScan, *, replace_files: bool) -> None:
    path, damaged = scan.path, [file for file in scan.files if file.damage]
    if scan.is_newer:
        problem = 'is of a version newer than is known here: it cannot be written again'
        raise BagError(path / METADATA_NAME, problem)
    aside = [*scan.unfinished, *(file.path for file in damaged)]
    if (path / METADATA_NAME).exists():
        aside.append(path / METADATA_NAME)
    kept = [_name_to_keep(file) for file in aside]
    with TemporaryDirectory(dir=path, prefix='.repair-') as folder:
        repaired = [Path(folder) / file.path.name for file in damaged]
        for source, target in zip(damaged, repaired, strict=True):
            source.write_repaired(target, metadata_text(scan.metadata))
        for file, target in zip(aside, kept, strict=True):
            _move(file, target)
        for file in repaired:
            file.rename(path / file.name)
    write_metadata(path, scan.metadata)
    if problems := scan_bag(path).problems:
        raise BagError(path, f'is not repaired: {problems[0]}')
    for file in kept if replace_files else ():
        for each in (file, *journals_of(file)):
            each.unlink(missing_ok=True)


def _name_to_keep(file: Path) -> Path:
    kept = file.with_name(f'{file.name}.damaged')
    if kept.exists():
        raise BagError(file.parent, f'holds {kept.name} of an earlier repair: move it away first')
    return kept


def _move(file: Path, target: Path) -> None:
    """Rename a file, with its SQLite journals if there are some."""
    for journal, renamed in zip(journals_of(file), journals_of(target), strict=True):
        if journal.exists():
            journal.rename(renamed)
    file.rename(target)
