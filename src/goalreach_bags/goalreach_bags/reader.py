"""Reading a bag, with every mistake as one line."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final

from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.rosbag2 import Reader
import yaml

from goalreach_bags.metadata import METADATA_NAME, METADATA_VERSION
from goalreach_bags.topic import BagError, BagTopic, QosOffer
from goalreach_msgs_py.files import load_yaml

_ROOT: Final = 'rosbag2_bagfile_information'
_NS_PER_S: Final = 1_000_000_000


@dataclass(frozen=True, kw_only=True)
class BagMessage:
    """A message of a bag.

    Attributes:
        topic: Name of its topic.
        time_ns: Receive time.
        data: The serialized message.
    """

    topic: str
    time_ns: int
    data: bytes


def storage_files(path: Path) -> list[Path]:
    """Return the storage files in a bag's directory, in the order of their numbers."""
    files = [*path.glob('*.mcap'), *path.glob('*.db3')]
    return sorted(files, key=lambda file: (len(file.name), file.name))


class BagReader:
    """A bag that is open for reading; a context manager.

    Attributes:
        path: Its directory.
        topics: Its topics by name.
        counts: Messages by topic.
        custom: The recorder's own texts.
        storage: 'mcap' or 'sqlite3'.
        files: Names of its files.

    Args:
        path: The directory.

    Raises:
        BagError: It is no bag, is damaged, or of a version that cannot be read.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        information = _read_metadata(self.path)
        self.storage = str(information.get('storage_identifier', ''))
        self.files = [str(name) for name in information.get('relative_file_paths') or ()]
        self.version = int(information['version'])
        self.distro = str(information.get('ros_distro') or '')
        self.custom: Mapping[str, str] = information.get('custom_data') or {}
        self._reader = _reader(self.path)
        try:
            with _told_of(self.path):
                self.topics = {c.topic: _topic(c) for c in self._reader.connections}
                self.counts = dict.fromkeys(self.topics, 0)
                for connection in self._reader.connections:
                    self.counts[connection.topic] += int(connection.msgcount)
        except BaseException:
            self._reader.close()
            raise

    @property
    def first_ns(self) -> int:
        """Receive time of the first message; 0 where there is none."""
        return self._reader.start_time if self._reader.message_count else 0

    @property
    def last_ns(self) -> int:
        """Receive time of the last message; 0 where there is none."""
        return self._reader.end_time - 1 if self._reader.message_count else 0

    def require(self, names: Collection[str]) -> None:
        """Look whether there are messages of topics.

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
            BagError: The file is damaged, or holds less than its summary promises.
        """
        wanted = [c for c in self._reader.connections if topics is None or c.topic in topics]
        if not wanted:
            return
        found = 0
        with _told_of(self.path):
            for connection, time_ns, data in self._reader.messages(wanted, start_ns, stop_ns):
                found += 1
                yield BagMessage(topic=connection.topic, time_ns=time_ns, data=bytes(data))
        whole = start_ns is None and stop_ns is None
        promised = sum(int(connection.msgcount) for connection in wanted) if whole else 0
        if found < promised:
            problem = f'holds {found} of the {promised} messages that its summary promises'
            raise BagError(self.path, f'{problem}; goalreach record --repair may help')

    def close(self) -> None:
        """Close it."""
        self._reader.close()

    def __enter__(self) -> BagReader:  # noqa: PYI034 - Self is newer than Python 3.10
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _read_metadata(path: Path) -> dict[str, Any]:
    if not path.exists():
        raise BagError(path, 'does not exist')
    if not path.is_dir():
        raise BagError(path, 'is not a bag: a bag is a directory')
    metadata = path / METADATA_NAME
    if not metadata.exists():
        if storage_files(path):
            raise BagError(path, 'was not finished: goalreach record --repair brings it in order')
        raise BagError(path, f'is not a bag: it holds no {METADATA_NAME}')
    try:
        information = load_yaml(metadata.read_text(encoding='utf-8'))[_ROOT]
        version = int(information['version'])
    except OSError as error:
        raise BagError(metadata, f'cannot be read: {error.strerror}') from None
    except (yaml.YAMLError, UnicodeDecodeError, TypeError, KeyError, ValueError):
        raise BagError(metadata, 'is not the summary of a bag') from None
    if version > METADATA_VERSION:
        raise BagError(path, f'is of version {version}: versions to {METADATA_VERSION} are known')
    return dict(information)


def _reader(path: Path) -> Reader:
    with _told_of(path):
        reader = Reader(path)
        reader.open()
        return reader
    raise AssertionError  # pragma: no cover - the context manager never swallows


@contextmanager
def _told_of(path: Path) -> Iterator[None]:
    """Turn whatever a reader stumbles over in a damaged file into one line."""
    try:
        yield
    except (BagError, GeneratorExit, KeyboardInterrupt):
        raise
    except Exception as error:  # noqa: BLE001 - damage shows in many ways
        lines = str(error).strip().splitlines() or [type(error).__name__]
        problem = f'is damaged or cut short ({lines[0].rstrip(".")})'
        raise BagError(path, f'{problem}; goalreach record --repair may help') from None


def _topic(connection: Connection) -> BagTopic:
    offers = getattr(connection.ext, 'offered_qos_profiles', None) or ()
    idl = connection.msgdef.format is MessageDefinitionFormat.IDL
    return BagTopic(
        name=connection.topic,
        type_name=connection.msgtype,
        type_hash=connection.digest,
        offers=tuple(_offer(offer) for offer in offers),
        definition=connection.msgdef.data,
        encoding='ros2idl' if idl else 'ros2msg',
    )


def _offer(offer: Any) -> QosOffer:  # noqa: ANN401 - a value of rosbags
    return QosOffer(
        history=offer.history.name.lower(),
        depth=int(offer.depth),
        reliability=offer.reliability.name.lower(),
        durability=offer.durability.name.lower(),
        liveliness=offer.liveliness.name.lower(),
        deadline_ns=_nanoseconds(offer.deadline),
        lifespan_ns=_nanoseconds(offer.lifespan),
        liveliness_lease_duration_ns=_nanoseconds(offer.liveliness_lease_duration),
    )


def _nanoseconds(duration: Any) -> int:  # noqa: ANN401 - a value of rosbags
    # A damaged file may hold words here, which would be repeated a billion times.
    return int(duration.sec) * _NS_PER_S + int(duration.nsec)
