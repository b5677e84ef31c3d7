"""Reading a bag; every mistake is one line."""

from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
import logging
from pathlib import Path
import shutil
from tempfile import TemporaryDirectory
from typing import Final

import zstandard

from goalreach_bags.mcap_file import McapReader
from goalreach_bags.metadata import (
    METADATA_NAME,
    METADATA_VERSION,
    BagMetadata,
    read_metadata,
    total_span,
)
from goalreach_bags.repair import inspect_bag
from goalreach_bags.sqlite_file import SqliteReader
from goalreach_bags.storage import BagError, BagMessage, storage_files
from goalreach_bags.topic import merge_topics

_FRAME_HEAD_BYTES: Final = 18
"""Longest header of a zstd frame."""

_LOG: Final = logging.getLogger(__name__)
_StorageReader = McapReader | SqliteReader
_READERS: Final[Mapping[str, type[_StorageReader]]] = {'mcap': McapReader, 'sqlite3': SqliteReader}


class BagReader(ExitStack):
    """A bag open for reading; a context manager.

    Topics are matched by name, and times and counts are those of the messages: the metadata of
    other writers does not always agree with the files.

    Attributes:
        path: Its directory.
        metadata: Contents of `metadata.yaml`.
        topics: Its topics by name.
        counts: Messages by topic.
        first_ns: Receive time of the first message; 0 where there is none.
        last_ns: Receive time of the last message; 0 where there is none.

    Args:
        path: The directory.

    Raises:
        BagError: It is no bag, is damaged, or of a version that cannot be read.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        super().__init__()
        self.metadata = _read_metadata(self.path)
        with _one_line(self.path), ExitStack() as opened:
            make, files = _READERS[self.metadata.storage], self._storage_paths(opened)
            self._files = [make(file, opened) for file in files]
            self.push(opened.pop_all())
        sources = (*self._files, self.metadata)
        self.topics = merge_topics(topic for source in sources for topic in source.topics)
        total = total_span(file.span for file in self._files)
        self.counts: dict[str, int] = {**dict.fromkeys(self.topics, 0), **total.counts}
        self.first_ns = total.first_ns if total.message_count else 0
        self.last_ns = total.last_ns if total.message_count else 0

    def require(self, names: Collection[str]) -> None:
        """Check that topics have messages.

        Raises:
            BagError: A topic is missing, or has no message.
        """
        missing = sorted(name for name in names if not self.counts.get(name))
        if missing:
            raise BagError(self.path, f'holds no message of {", ".join(missing)}')

    def messages(
        self,
        topics: Collection[str] | None = None,
        *,
        start_ns: int | None = None,
        stop_ns: int | None = None,
    ) -> Iterator[BagMessage]:
        """Yield messages in the order of their receive time.

        Args:
            topics: Names of topics, all if None.
            start_ns: Only messages from this receive time on.
            stop_ns: Only messages before this receive time.

        Raises:
            BagError: The file is damaged, or holds fewer messages than it promises.
        """
        wanted = set(self.topics if topics is None else topics) & self.topics.keys()
        compressed = self.metadata.compression_mode == 'MESSAGE'
        found = 0
        with _one_line(self.path):
            for file in self._files:
                for name, time_ns, data in file.messages(wanted, start_ns, stop_ns):
                    found += 1
                    content = zstandard.decompress(data) if compressed else data
                    yield BagMessage(topic=name, time_ns=time_ns, data=content)
        if start_ns is not None or stop_ns is not None:
            return
        for source, counts in (('files', self.counts), ('metadata', self.metadata.total.counts)):
            promised = sum(counts.get(name, 0) for name in wanted)
            if found < promised:
                problem = f'holds {found} of the {promised} messages that its {source} promise'
                raise BagError(self.path, _with_advice(self.path, problem))

    def _storage_paths(self, opened: ExitStack) -> list[Path]:
        """Return the paths of the files; compressed ones are decompressed until it is closed."""
        paths = [self.path / file.name for file in self.metadata.files]
        if self.metadata.compression_mode != 'FILE':
            return paths
        folder = Path(opened.enter_context(TemporaryDirectory(prefix='goalreach-')))
        for path in paths:
            with path.open('rb') as source, (folder / path.stem).open('wb') as target:
                size = zstandard.frame_content_size(source.read(_FRAME_HEAD_BYTES))
                source.seek(0)
                shutil.copyfileobj(zstandard.open(source, 'rb'), target)
                if target.tell() < size:
                    raise BagError(self.path, f'{path.name}: its zstd frame is cut short')
        return [folder / path.stem for path in paths]


def _read_metadata(path: Path) -> BagMetadata:
    if not path.exists():
        raise BagError(path, 'does not exist')
    if not path.is_dir():
        raise BagError(path, 'is not a bag: a bag is a directory')
    if not (path / METADATA_NAME).exists():
        if storage_files(path):
            raise BagError(path, _with_advice(path, f'has no {METADATA_NAME}'))
        zstd = '; files that are compressed as a whole need it' if any(path.glob('*.zstd')) else ''
        raise BagError(path, f'is not a bag: it holds no {METADATA_NAME}{zstd}')
    metadata = read_metadata(path)
    if metadata.storage not in _READERS:
        problem = f'storage plug-in {metadata.storage!r} is not known'
        raise BagError(path, f'{problem}: {" and ".join(_READERS)} are')
    if metadata.compression_mode and metadata.compression_format != 'zstd':
        problem = f'compression {metadata.compression_format!r} is not known'
        raise BagError(path, f'{problem}: zstd is')
    for file in metadata.files:
        if not (path / file.name).exists():
            raise BagError(path, f'lacks its file {file.name}')
    if metadata.version > METADATA_VERSION:
        known = f'versions to {METADATA_VERSION} are known; what else it says is not read'
        _LOG.warning('%s: is of version %d: %s', path / METADATA_NAME, metadata.version, known)
    return metadata


def _with_advice(path: Path, problem: str) -> str:
    problems, advice = inspect_bag(path)
    return f'{problem}; {advice}' if problems and advice else problem


@contextmanager
def _one_line(path: Path) -> Iterator[None]:
    """Turn any error that a damaged file causes into one line that names the fault."""
    try:
        yield
    except (BagError, GeneratorExit, KeyboardInterrupt):
        raise
    except Exception as error:  # noqa: BLE001 - damage shows in many ways
        lines = str(error).strip().splitlines() or [type(error).__name__]
        problems, advice = inspect_bag(path)
        known = '; '.join(filter(None, (*problems[:3], advice)))
        problem = known if problems else f'cannot be read: {lines[0].rstrip(".")}'
        raise BagError(path, problem) from None
