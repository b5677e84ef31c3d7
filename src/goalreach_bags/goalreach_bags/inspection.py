"""What the files of a bag hold, what is the matter with them, and whether a repair helps."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from goalreach_bags.mcap_repair import MAGIC, McapScan, scan_mcap
from goalreach_bags.metadata import (
    METADATA_NAME,
    METADATA_VERSION,
    BagMetadata,
    parse_metadata,
    total_span,
)
from goalreach_bags.sqlite_file import SqliteScan, is_truncated_database, scan_sqlite
from goalreach_bags.storage import SUFFIXES, BagError, storage_files
from goalreach_bags.topic import merge_topics

StorageScan = McapScan | SqliteScan
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
    def damaged(self) -> list[StorageScan]:
        """Files that a repair writes again."""
        return [file for file in self.files if file.damage]

    @property
    def problems(self) -> tuple[str, ...]:
        """What is the matter with the bag, in the terms of its formats; none for a sound one."""
        damages = [f'{file.path.name}: {file.damage}' for file in self.damaged]
        damages += [f'{file.name}: ends within its first bytes' for file in self.unfinished]
        wrong = _disagreements(self.existing, self.metadata)
        return tuple(damages or [f'{METADATA_NAME}: {text}' for text in wrong])

    @property
    def is_newer(self) -> bool:
        """Whether the metadata is of a version newer than is known here."""
        return self.existing is not None and self.existing.version > METADATA_VERSION


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
    if existing.compression_mode != metadata.compression_mode:
        yield f'names the compression mode {existing.compression_mode!r}'


def inspect_bag(path: Path) -> tuple[tuple[str, ...], str]:
    """Read all files of a bag whole.

    Returns:
        What is the matter with it; and how to repair it, where a repair helps.
    """
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
