"""What a bag says about a topic: type, definition, hash and the offered quality of service."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import errno
from functools import lru_cache
import importlib
import math
import os
from pathlib import Path
import re
import sys
from typing import Any, Final, Protocol

import yaml

from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, GoalreachError
from goalreach_msgs_py.files import load_yaml
from goalreach_msgs_py.options import CommandOptions, option

INFINITE_NS: Final = 2**63 - 1
"""A duration without end; rosbag2 writes it as 9223372036 s and 854775807 ns."""

_NS_PER_S: Final = 1_000_000_000
_DURATIONS: Final = ('deadline', 'lifespan', 'liveliness_lease_duration')


@dataclass(frozen=True, kw_only=True)
class QosOffer:
    """Quality of service that one publisher offered, in the words of rosbag2's version 9.

    Attributes:
        history: 'keep_last', 'keep_all' or 'unknown': DDS does not tell it to others.
        depth: 0 where unknown.
        reliability: 'reliable' or 'best_effort'.
        durability: 'transient_local' or 'volatile'.
        liveliness: 'automatic' or 'manual_by_topic'.
        deadline_ns: Promised time between messages.
        lifespan_ns: How long a message is worth something.
        liveliness_lease_duration_ns: Within which the publisher shows that it lives.
    """

    history: str = 'unknown'
    depth: int = 0
    reliability: str = 'reliable'
    durability: str = 'volatile'
    liveliness: str = 'automatic'
    deadline_ns: int = INFINITE_NS
    lifespan_ns: int = INFINITE_NS
    liveliness_lease_duration_ns: int = INFINITE_NS

    def to_document(self) -> dict[str, Any]:
        """Return the mapping that rosbag2 writes, keys in its order."""
        return {
            'history': self.history,
            'depth': self.depth,
            'reliability': self.reliability,
            'durability': self.durability,
            'deadline': _duration(self.deadline_ns),
            'lifespan': _duration(self.lifespan_ns),
            'liveliness': self.liveliness,
            'liveliness_lease_duration': _duration(self.liveliness_lease_duration_ns),
            'avoid_ros_namespace_conventions': False,
        }


@dataclass(frozen=True, kw_only=True)
class BagTopic:
    """One topic of a bag.

    Attributes:
        name: Name with its leading slash.
        type_name: `package/msg/Name`.
        type_hash: `RIHS01_...`, or empty where the bag does not tell it.
        offers: What each publisher offered.
        definition: Text of the message definition with all that it is made of.
        encoding: Format of the definition, `ros2msg` or `ros2idl`.
    """

    name: str
    type_name: str
    type_hash: str
    offers: tuple[QosOffer, ...]
    definition: str
    encoding: str = 'ros2msg'


def _duration(value_ns: int) -> dict[str, int]:
    return {'sec': value_ns // _NS_PER_S, 'nsec': value_ns % _NS_PER_S}


def offers_to_text(offers: Sequence[QosOffer]) -> str:
    """Return offers as the YAML text inside MCAP channels and SQLite topics."""
    documents = [offer.to_document() for offer in offers]
    return yaml.safe_dump(documents, sort_keys=False) if documents else ''


def parse_offers(text: str) -> tuple[QosOffer, ...]:
    """Return the offers of such a text; of one that is not understood, none."""
    try:
        documents = load_yaml(text) or []
        return tuple(_offer(document) for document in documents)
    except (yaml.YAMLError, TypeError, KeyError, AttributeError, ValueError, OverflowError):
        return ()


def _offer(document: dict[str, Any]) -> QosOffer:
    times = {
        f'{name}_ns': int(document[name]['sec']) * _NS_PER_S + int(document[name]['nsec'])
        for name in _DURATIONS
    }
    words = {
        name: str(document[name])
        for name in ('history', 'reliability', 'durability', 'liveliness')
    }
    return QosOffer(depth=int(document['depth']), **words, **times)  # type: ignore[arg-type]


class BagError(FileFormatError):
    """A bag cannot be used or made; the text is `path: problem`."""


class BagStoppedError(BagError):
    """The disk took no more: the bag was closed early and holds what was written until then.

    Attributes:
        closed: Whether the bag is complete in itself; if not, it must be repaired.
    """

    def __init__(self, path: str | Path, problem: str, *, closed: bool) -> None:
        self.closed = closed
        super().__init__(path, problem)


@dataclass(frozen=True, kw_only=True)
class TopicSelection:
    """Topics by name and by pattern; all where neither is given.

    Hidden topics, those with a part that begins with an underscore, are meant only by name.

    """

    names: tuple[str, ...] = option(
        (), 'topics by name, with or without the leading slash (default: all)', flag='--topics',
        metavar='NAME',
    )  # fmt: skip
    patterns: tuple[str, ...] = option(
        (), 'topics whose name matches; repeatable', flag='--regex', metavar='PATTERN',
        repeatable=True,
    )  # fmt: skip
    exclude: tuple[str, ...] = option(
        (), 'leave out topics whose name matches; repeatable', metavar='PATTERN', repeatable=True
    )

    def __post_init__(self) -> None:
        """Check the patterns."""
        for flag, patterns in (('--regex', self.patterns), ('--exclude', self.exclude)):
            for pattern in patterns:
                _require_pattern(flag, pattern)

    def includes(self, topic: str) -> bool:
        """Return whether a topic is meant."""
        if topic in self.full_names:
            return True
        hidden = any(part.startswith('_') for part in topic.split('/'))
        if hidden or any(re.search(pattern, topic) for pattern in self.exclude):
            return False
        if self.patterns:
            return any(re.search(pattern, topic) for pattern in self.patterns)
        return not self.names

    @property
    def full_names(self) -> frozenset[str]:
        """The names with their leading slash."""
        return frozenset(name if name.startswith('/') else f'/{name}' for name in self.names)


def _require_pattern(flag: str, pattern: str) -> None:
    try:
        re.compile(pattern)
    except re.error as error:
        raise ConfigurationError(flag, pattern, f'a pattern: {error}') from None


_BYTES_PER_MB: Final = 1_000_000
STORAGES: Final = ('mcap', 'sqlite3')


@dataclass(frozen=True, kw_only=True)
class StorageOptions(CommandOptions):
    """Storage format of a bag, its compression, and when it is split into further files."""

    storage: str = option('mcap', 'storage format', choices=STORAGES)
    zstd: bool = option(
        False, 'compress: MCAP by the chunk, SQLite by the message, as rosbag2 does'
    )
    max_size: float | None = option(None, 'start a new file at this size', metavar='MB', above=0.0)
    max_duration: float | None = option(
        None, 'start a new file after this time, seconds', metavar='S', above=0.0
    )

    @property
    def max_bytes(self) -> float:
        """Size at which a new file is started."""
        return math.inf if self.max_size is None else self.max_size * _BYTES_PER_MB

    @property
    def max_duration_ns(self) -> float:
        """Duration after which a new file is started."""
        return math.inf if self.max_duration is None else self.max_duration * _NS_PER_S


class StorageFile(Protocol):
    """One file of a bag being written.

    What has been flushed survives the death of the process. Every method may raise OSError; the
    file then still ends after what was flushed before.
    """

    @property
    def size(self) -> int:
        """Bytes so far, those in memory included."""
        ...

    @property
    def wants_flush(self) -> bool:
        """Whether so much is pending that it should be flushed."""
        ...

    def add_topic(self, number: int, topic: BagTopic) -> None:
        """Add a topic before its first message."""
        ...

    def write(self, number: int, time_ns: int, publish_ns: int, data: bytes) -> None:
        """Add a message."""
        ...

    def flush(self) -> None:
        """Hand what is pending to the operating system."""
        ...

    def drop_pending(self) -> None:
        """Forget what is pending: there is no room for it."""
        ...

    def finish(self, metadata: str) -> None:
        """Flush, add the bag's summary, and close."""
        ...

    def close(self) -> None:
        """Close without a summary."""
        ...


_MARGIN_BYTES: Final = 256 * 1024
"""Left for summary and metadata, and for others who write. Chosen."""


def require_room(path: Path, needed: int) -> None:
    """Look whether a file can grow.

    Args:
        path: The file.
        needed: By how many bytes.

    Raises:
        OSError: ENOSPC, before anything was written.
    """
    status = os.statvfs(path.parent)
    if status.f_bavail * status.f_frsize < needed + _MARGIN_BYTES:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


_NAME: Final = 'compression.zstd' if sys.version_info >= (3, 14) else 'backports.zstd'
_zstd: Final[Any] = importlib.import_module(_NAME)
_LEVEL: Final = 1
"""Chosen: a camera's noise does not shrink much more at higher levels, which cost far more."""


def compress(data: bytes) -> bytes:
    """Return the data compressed."""
    return bytes(_zstd.compress(data, level=_LEVEL))


def decompress(data: bytes) -> bytes:
    """Return compressed data as it was.

    Raises:
        ValueError: It is no Zstandard frame.
    """
    try:
        return bytes(_zstd.decompress(data))
    except (_zstd.ZstdError, EOFError) as error:
        raise ValueError(str(error)) from None


_SEPARATOR: Final = 80 * '='
_FIELD: Final = re.compile(r'^\s*([A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+\w+', re.MULTILINE)
_BUILT_IN: Final = re.compile(r'^(?:bool|byte|char|w?string|float\d+|u?int\d+)$')
_PARTS: Final = 3


@lru_cache(maxsize=256)
def message_definition(type_name: str) -> str:
    """Return a message's definition, followed by those of all that it is made of.

    Args:
        type_name: `package/msg/Name`.

    Raises:
        GoalreachError: The package is not installed, or brings no `.msg` file.
    """
    parts = type_name.split('/')
    if len(parts) != _PARTS or parts[1] != 'msg':
        raise GoalreachError(f'{type_name}: is not the name of a message')
    seen: set[str] = set()
    return _full_text(parts[0], parts[2], seen)


def _full_text(package: str, name: str, seen: set[str]) -> str:
    text = _read(package, name)
    result = text
    for inner_package, inner in sorted(_made_of(package, text)):
        full_name = f'{inner_package}/{inner}'
        if full_name not in seen:
            seen.add(full_name)
            result += f'\n{_SEPARATOR}\nMSG: {full_name}\n'
            result += _full_text(inner_package, inner, seen)
    return result


def _made_of(package: str, text: str) -> set[tuple[str, str]]:
    found = set()
    for name in _FIELD.findall(re.sub(r'#.*', '', text)):
        if not _BUILT_IN.match(name):
            parts = name.split('/')
            owner = package if len(parts) == 1 else parts[0]
            found.add((owner, parts[-1]))
    return found


def _read(package: str, name: str) -> str:
    prefixes = [*os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    for prefix in filter(None, prefixes):
        path = Path(prefix) / 'share' / package / 'msg' / f'{name}.msg'
        try:
            return path.read_text(encoding='utf-8')
        except OSError:
            continue
    raise GoalreachError(f'{package}/msg/{name}: its definition is not installed')
