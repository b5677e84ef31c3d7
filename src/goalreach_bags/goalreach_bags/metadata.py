"""The summary of a bag, `metadata.yaml`, in the version that Jazzy writes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import yaml

from goalreach_bags.topic import INFINITE_NS, BagTopic
from goalreach_msgs_py.files import write_text_atomically

METADATA_VERSION: Final = 9
ROS_DISTRO: Final = 'jazzy'


@dataclass(frozen=True, kw_only=True)
class FileSpan:
    """What one file of a bag holds.

    Attributes:
        name: File name inside the bag's directory.
        counts: Messages by topic name.
        first_ns: Earliest receive time; meaningless while there is no message.
        last_ns: Latest receive time.
    """

    name: str
    counts: Mapping[str, int] = field(default_factory=dict)
    first_ns: int = INFINITE_NS
    last_ns: int = 0

    @property
    def message_count(self) -> int:
        """Messages of all topics."""
        return sum(self.counts.values())

    @property
    def duration_ns(self) -> int:
        """Time between the first and the last message."""
        return max(0, self.last_ns - self.first_ns)


@dataclass(frozen=True, kw_only=True)
class BagMetadata:
    """A bag in short.

    Attributes:
        storage: 'mcap' or 'sqlite3'.
        topics: Its topics.
        files: Its files in the order of time.
        compression_mode: 'MESSAGE' where each message is compressed, else empty: compression
            inside an MCAP file is the file's own affair.
        custom: Texts of the recorder's own.
    """

    storage: str
    topics: tuple[BagTopic, ...]
    files: tuple[FileSpan, ...]
    compression_mode: str = ''
    custom: Mapping[str, str] = field(default_factory=dict)

    @property
    def total(self) -> FileSpan:
        """All files as one span."""
        return _sum(self.files)

    def to_document(self) -> dict[str, Any]:
        """Return the mapping under `rosbag2_bagfile_information`, keys in rosbag2's order."""
        total = self.total
        return {
            'version': METADATA_VERSION,
            'storage_identifier': self.storage,
            **_times(total),
            'message_count': total.message_count,
            'topics_with_message_count': [
                {
                    'topic_metadata': {
                        'name': topic.name,
                        'type': topic.type_name,
                        'serialization_format': 'cdr',
                        'offered_qos_profiles': [o.to_document() for o in topic.offers],
                        'type_description_hash': topic.type_hash,
                    },
                    'message_count': total.counts.get(topic.name, 0),
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
            'ros_distro': ROS_DISTRO,
        }


def _times(span: FileSpan) -> dict[str, Any]:
    return {
        'duration': {'nanoseconds': span.duration_ns},
        'starting_time': {'nanoseconds_since_epoch': span.first_ns},
    }


def _sum(spans: Iterable[FileSpan]) -> FileSpan:
    total = FileSpan(name='')
    counts: dict[str, int] = {}
    for span in spans:
        for name, count in span.counts.items():
            counts[name] = counts.get(name, 0) + count
        total = replace(
            total,
            first_ns=min(total.first_ns, span.first_ns),
            last_ns=max(total.last_ns, span.last_ns),
        )
    return replace(total, counts=counts)


METADATA_NAME: Final = 'metadata.yaml'
_ROOT: Final = 'rosbag2_bagfile_information'


def metadata_text(metadata: BagMetadata) -> str:
    """Return the summary as the YAML text that is kept inside a storage file too."""
    return str(yaml.safe_dump(metadata.to_document(), sort_keys=False))


def write_metadata(directory: Path, metadata: BagMetadata) -> None:
    """Write the summary beside the storage files.

    Raises:
        FileFormatError: It cannot be written.
    """
    document = {_ROOT: metadata.to_document()}
    write_text_atomically(directory / METADATA_NAME, yaml.safe_dump(document, sort_keys=False))
