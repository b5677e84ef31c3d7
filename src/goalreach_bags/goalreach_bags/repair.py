"""Repair of bags whose recorder was killed, without harm to any file."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from goalreach_bags.inspection import BagScan, StorageScan, scan_bag
from goalreach_bags.metadata import METADATA_NAME, metadata_text, write_metadata
from goalreach_bags.reader import BagReader
from goalreach_bags.storage import NOT_CLOSED, BagError
from goalreach_bags.writer import FLUSH_S

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
        holds = f'{self.messages} messages, {self.duration_s:.1f} s'
        if self.was_sound:
            return f'{self.path}: nothing to repair: {holds}'
        lost = []
        if self.dropped_bytes:
            lost.append(f'{self.dropped_bytes} bytes of unfinished or damaged records')
        if any(NOT_CLOSED in problem for problem in self.damage.values()):
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
    try:
        return _repair(scan_bag(path), replace_files=replace_files)
    except OSError as error:
        raise BagError(path, f'cannot be repaired: {error.strerror or error}') from None


def _repair(scan: BagScan, *, replace_files: bool) -> RepairResult:
    path, damaged, metadata = scan.path, scan.damaged, scan.metadata
    was_sound = not scan.problems
    if not was_sound:
        if scan.is_newer:
            problem = 'is of a version newer than is known here: it cannot be written again'
            raise BagError(path / METADATA_NAME, problem)
        aside = [*scan.unfinished, *(file.path for file in damaged)]
        if (path / METADATA_NAME).exists():
            aside.append(path / METADATA_NAME)
        _require_free_names(path, aside)
        _write_repaired(damaged, metadata_text(metadata))
        for file in aside:
            _move(file, file.with_name(f'{file.name}.damaged'))
        for repaired in damaged:
            _repaired(repaired.path).rename(repaired.path)
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
        damage={file.path.name: file.damage for file in damaged},
        dropped_bytes=sum(file.dropped_bytes for file in scan.files),
        was_sound=was_sound,
    )


def _write_repaired(scans: Sequence[StorageScan], metadata: str) -> None:
    """Write the repaired files, all or none."""
    try:
        for scan in scans:
            scan.write_repaired(_repaired(scan.path), metadata)
    except BaseException:
        for scan in scans:
            _repaired(scan.path).unlink(missing_ok=True)
        raise


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
