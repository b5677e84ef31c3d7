"""Header, schemas, channels and chunks of an MCAP file, and the indexes of chunks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import struct
from typing import Final
from zlib import crc32

from goalreach_bringup.bags.mcap_records import (
    MAGIC,
    RECORD_HEAD,
    Opcode,
    number_map,
    record,
    text,
    text_map,
)
from goalreach_bringup.bags.topic import INFINITE_NS, BagTopic, offers_to_text

__all__ = ['ChunkInfo', 'OpenChunk', 'channel_record', 'header_record', 'schema_record']

_MESSAGE: Final = struct.Struct('<BQHIQQ')
_MESSAGE_FIELDS: Final = 22
_INDEX_ENTRY: Final = struct.Struct('<QQ')
_LIBRARY: Final = 'goalreach'


def header_record() -> bytes:
    """Return the beginning of a file."""
    return MAGIC + record(Opcode.HEADER, text('ros2'), text(_LIBRARY))


def schema_record(number: int, topic: BagTopic) -> bytes:
    """Return the definition of a topic's type."""
    definition = topic.definition.encode()
    return record(
        Opcode.SCHEMA,
        struct.pack('<H', number),
        text(topic.type_name),
        text(topic.encoding),
        struct.pack('<I', len(definition)),
        definition,
    )


def channel_record(number: int, schema: int, topic: BagTopic) -> bytes:
    """Return a topic with its quality of service and type hash, as rosbag2 keeps them."""
    values = {
        'offered_qos_profiles': offers_to_text(topic.offers),
        'topic_type_hash': topic.type_hash,
    }
    return record(
        Opcode.CHANNEL,
        struct.pack('<HH', number, schema),
        text(topic.name),
        text('cdr'),
        text_map(values),
    )


@dataclass(frozen=True, kw_only=True)
class ChunkInfo:
    """A chunk that is in the file.

    Attributes:
        offset: Where its record begins.
        length: Length of its record.
        indexes: Offset of each channel's message index, which follow the chunk.
        index_length: Length of all of them.
        counts: Messages by channel.
        first_ns: Earliest message.
        last_ns: Latest message.
        compression: 'zstd' or empty.
        sizes: Size in the file, size of the records.
    """

    offset: int
    length: int
    indexes: Mapping[int, int]
    index_length: int
    counts: Mapping[int, int]
    first_ns: int
    last_ns: int
    compression: str
    sizes: tuple[int, int]

    def index_record(self) -> bytes:
        """Return its entry in the summary."""
        return record(
            Opcode.CHUNK_INDEX,
            struct.pack('<QQQQ', self.first_ns, self.last_ns, self.offset, self.length),
            number_map(self.indexes.items()),
            struct.pack('<Q', self.index_length),
            text(self.compression),
            struct.pack('<QQ', *self.sizes),
        )


@dataclass
class OpenChunk:
    """A chunk that is being filled in memory.

    Attributes:
        size: Bytes of its records so far.
        entries: Time and offset of each message by channel.
    """

    size: int = 0
    entries: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    first_ns: int = INFINITE_NS
    last_ns: int = 0
    _parts: list[bytes] = field(default_factory=list)

    def add_record(self, data: bytes) -> None:
        """Add a schema or a channel."""
        self._parts.append(data)
        self.size += len(data)

    def add_message(self, channel: int, time_ns: int, publish_ns: int, data: bytes) -> None:
        """Add a message."""
        self.note(channel, time_ns, self.size)
        head = _MESSAGE.pack(
            Opcode.MESSAGE, _MESSAGE_FIELDS + len(data), channel, 0, time_ns, publish_ns
        )
        self._parts += (head, data)
        self.size += len(head) + len(data)

    def note(self, channel: int, time_ns: int, offset: int) -> None:
        """Add a message to the index."""
        self.entries.setdefault(channel, []).append((time_ns, offset))
        self.first_ns = min(self.first_ns, time_ns)
        self.last_ns = max(self.last_ns, time_ns)

    def records(self) -> bytes:
        """Return its records."""
        return b''.join(self._parts)

    def chunk_head(self, compression: str, stored_size: int) -> bytes:
        """Return what comes before the stored records; the check sum is of the records.

        Args:
            compression: 'zstd' or empty.
            stored_size: Bytes of the records as they will be stored.
        """
        checksum = 0
        for part in self._parts:
            checksum = crc32(part, checksum)
        first_ns = self.first_ns if self.entries else 0
        fields = struct.pack('<QQQI', first_ns, self.last_ns, self.size, checksum)
        content = fields + text(compression) + struct.pack('<Q', stored_size)
        return RECORD_HEAD.pack(Opcode.CHUNK, len(content) + stored_size) + content

    def index_records(self) -> dict[int, bytes]:
        """Return the message index of each channel, as it follows the chunk."""
        return {
            channel: record(
                Opcode.MESSAGE_INDEX,
                struct.pack('<HI', channel, len(entries) * _INDEX_ENTRY.size),
                b''.join(_INDEX_ENTRY.pack(*entry) for entry in entries),
            )
            for channel, entries in self.entries.items()
        }

    def placed(
        self, offset: int, length: int, compression: str, sizes: tuple[int, int]
    ) -> ChunkInfo:
        """Return what the summary tells of it, once it lies in the file with its indexes."""
        position, indexes = offset + length, {}
        for channel, data in self.index_records().items():
            indexes[channel] = position
            position += len(data)
        return ChunkInfo(
            offset=offset,
            length=length,
            indexes=indexes,
            index_length=position - offset - length,
            counts={channel: len(entries) for channel, entries in self.entries.items()},
            first_ns=self.first_ns if self.entries else 0,
            last_ns=self.last_ns,
            compression=compression,
            sizes=sizes,
        )
