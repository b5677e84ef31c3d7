"""The metadata of a bag, `metadata.yaml`: written as Jazzy does, read in every version."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, Final

import yaml

from goalreach_bags.storage import NO_TIME_NS, BagError, FileSpan
from goalreach_bags.topic import BagTopic, parse_offers
from goalreach_msgs_py.files import load_yaml, write_text_atomically
from goalreach_msgs_py.ros.distribution import JAZZY

METADATA_NAME: Final = 'metadata.yaml'
METADATA_VERSION: Final = 9
ROS_DISTRO: Final = JAZZY.name
_ROOT: Final = 'rosbag2_bagfile_information'
_NAME_BYTES: Final = 255
"""Longest name of a file on Linux."""


@dataclass(frozen=True, kw_only=True)
class BagMetadata:
    """Metadata of a bag.

    Attributes:
        storage: 'mcap' or 'sqlite3'.
        topics: Its topics, as far as the metadata describes them: without definition.
        files: Its files in the order of time; without counts where metadata was read.
        compression_mode: 'MESSAGE' or 'FILE' where each message or file is compressed, else
            empty: compression inside an MCAP file is not part of the metadata.
        compression_format: How they are compressed, as rosbag2 names it: 'zstd', or empty.
        custom: Texts of the program that recorded.
    """

    storage: str
    topics: tuple[BagTopic, ...]
    files: tuple[FileSpan, ...]
    total: FileSpan
    compression_mode: str = ''
    compression_format: str = 'zstd'
    custom: Mapping[str, str] = field(default_factory=dict)
    distro: str = ROS_DISTRO
    version: int = METADATA_VERSION

    def to_document(self) -> dict[str, Any]:
        """Return the mapping under `rosbag2_bagfile_information`, keys in rosbag2's order."""
        return {
            'version': METADATA_VERSION,
            'storage_identifier': self.storage,
            **_times(self.total),
            'message_count': self.total.message_count,
            'topics_with_message_count': [
                {
                    'topic_metadata': {
                        'name': topic.name,
                        'type': topic.type_name,
                        'serialization_format': topic.serialization,
                        'offered_qos_profiles': list(topic.offers),
                        'type_description_hash': topic.type_hash,
                    },
                    'message_count': self.total.counts.get(topic.name, 0),
                }
                for topic in self.topics
            ],
            'compression_format': 'zstd' if self.compression_mode else '',
            'compression_mode': self.compression_mode,
            'relative_file_paths': [span.name for span in self.files],
            'files': [
                {'path': span.name, **_times(span), 'message_count': span.message_count}
                for span in self.files
            ],
            'custom_data': dict(self.custom) or None,
            'ros_distro': self.distro,
        }


def _times(span: FileSpan) -> dict[str, Any]:
    return {
        'duration': {'nanoseconds': span.duration_ns},
        'starting_time': {'nanoseconds_since_epoch': span.first_ns},
    }


def total_span(spans: Iterable[FileSpan]) -> FileSpan:
    """Return the messages of several files as one span without a name."""
    total = FileSpan(name='')
    for span in spans:
        total.counts.update(span.counts)
        total.first_ns = min(total.first_ns, span.first_ns)
        total.last_ns = max(total.last_ns, span.last_ns)
    return total


def metadata_text(metadata: BagMetadata) -> str:
    """Return the metadata as the YAML text of which each storage file holds a copy."""
    return str(yaml.safe_dump(metadata.to_document(), sort_keys=False))


def write_metadata(directory: Path, metadata: BagMetadata) -> None:
    """Write `metadata.yaml`."""
    document = {_ROOT: metadata.to_document()}
    write_text_atomically(directory / METADATA_NAME, yaml.safe_dump(document, sort_keys=False))


def read_metadata(directory: Path) -> BagMetadata:
    """Read `metadata.yaml`.

    Raises:
        BagError: It cannot be read, or is damaged.
    """
    path = directory / METADATA_NAME
    try:
        text = path.read_text(encoding='utf-8', errors='replace')
    except OSError as error:
        raise BagError(path, f'cannot be read: {error.strerror}') from None
    metadata = parse_metadata(text)
    if metadata is None:
        raise BagError(path, 'is not the metadata of a bag')
    return metadata


def parse_metadata(text: str) -> BagMetadata | None:
    """Return the metadata in the text of `metadata.yaml` or of a copy; None where it is none.

    Of a newer version than is known here, the fields that are known are read.
    """
    try:
        document = load_yaml(text)
        return _parse(document.get(_ROOT, document))
    except (yaml.YAMLError, AttributeError, KeyError, OverflowError, TypeError, ValueError):
        return None


def _parse(document: Any) -> BagMetadata:  # noqa: ANN401 - as YAML gives it
    version = int(document['version'])
    custom = document.get('custom_data')
    first_ns = int(document.get('starting_time', {}).get('nanoseconds_since_epoch', NO_TIME_NS))
    mode = str(document.get('compression_mode') or '').upper()
    listed = document.get('topics_with_message_count') or ()
    counts = {str(e['topic_metadata']['name']): int(e.get('message_count', 0)) for e in listed}
    paths = document.get('relative_file_paths') or [f['path'] for f in document['files']]
    # To version 3 they begin with the bag's directory; only their last part counts.
    names = [PurePosixPath(path).name for path in paths]
    if any(len(name.encode()) > _NAME_BYTES for name in names):
        raise ValueError('a name that no file can have')
    return BagMetadata(
        storage=str(document['storage_identifier']),
        topics=tuple(
            BagTopic(
                name=str(topic['name']),
                type_name=str(topic['type']),
                type_hash=str(topic.get('type_description_hash') or ''),
                offers=parse_offers(topic.get('offered_qos_profiles')),
                serialization=str(topic.get('serialization_format', 'cdr')),
            )
            for topic in (entry['topic_metadata'] for entry in listed)
        ),
        files=tuple(FileSpan(name=name) for name in names),
        total=FileSpan(
            name='',
            counts=Counter(counts),
            first_ns=first_ns,
            last_ns=first_ns + int(document.get('duration', {}).get('nanoseconds', 0)),
        ),
        compression_mode='' if mode == 'NONE' else mode,
        compression_format=str(document.get('compression_format') or ''),
        custom={str(k): str(v) for k, v in custom.items()} if isinstance(custom, dict) else {},
        distro=str(document.get('ros_distro') or ''),
        version=version,
    )
