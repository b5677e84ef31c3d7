"""Writing one MCAP file, chunk by chunk, so that a death at any moment loses no finished chunk."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
import struct
from typing import Final
from zlib import crc32

from goalreach_bags.topic import INFINITE_NS, BagTopic, compress, offers_to_text, require_room

MAGIC: Final = b'\x89MCAP0\r\n'
RECORD_HEAD: Final = struct.Struct('<BQ')
_U16: Final = struct.Struct('<H')
_U32: Final = struct.Struct('<I')
_U64: Final = struct.Struct('<Q')
_ENTRY: Final = struct.Struct('<HQ')


class Opcode(IntEnum):
    """Kinds of records that are written or read here."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


def record(opcode: Opcode, *parts: bytes) -> bytes:
    """Return a record made of the parts of its content."""
    return b''.join((RECORD_HEAD.pack(opcode, sum(map(len, parts))), *parts))


def text(value: str) -> bytes:
    """Return a string with its length."""
    data = value.encode()
    return _U32.pack(len(data)) + data


def text_map(values: Mapping[str, str]) -> bytes:
    """Return a map of strings with its length."""
    data = b''.join(text(key) + text(value) for key, value in values.items())
    return _U32.pack(len(data)) + data


def number_map(values: Iterable[tuple[int, int]]) -> bytes:
    """Return a map of 16-bit to 64-bit numbers with its length."""
    data = b''.join(_ENTRY.pack(key, value) for key, value in values)
    return _U32.pack(len(data)) + data


@dataclass
class Reader:
    """Reads the fields of a record's content one after the other.

    Attributes:
        data: The content.
        position: Where the next field begins.
    """

    data: memoryview
    position: int = 0

    def u16(self) -> int:
        """Return a 16-bit number."""
        return self._number(_U16)

    def u32(self) -> int:
        """Return a 32-bit number."""
        return self._number(_U32)

    def u64(self) -> int:
        """Return a 64-bit number."""
        return self._number(_U64)

    def bytes(self, length: int) -> memoryview:
        """Return the next bytes.

        Raises:
            ValueError: There are not that many.
        """
        if self.position + length > len(self.data):
            raise ValueError('a field ends after its record')
        self.position += length
        return self.data[self.position - length : self.position]

    def text(self) -> str:
        """Return a string."""
        return str(self.bytes(self.u32()), 'utf-8')

    def text_map(self) -> dict[str, str]:
        """Return a map of strings."""
        inner = Reader(self.bytes(self.u32()))
        values = {}
        while inner.position < len(inner.data):
            key = inner.text()
            values[key] = inner.text()
        return values

    def _number(self, form: struct.Struct) -> int:
        return int(form.unpack(self.bytes(form.size))[0])


def iterate_records(data: memoryview) -> Iterator[tuple[int, int, memoryview]]:
    """Yield offset, opcode and content of the records that follow one another in a chunk.

    Raises:
        ValueError: The last one is cut short.
    """
    position = 0
    while position < len(data):
        if position + RECORD_HEAD.size > len(data):
            raise ValueError('a record is cut short')
        opcode, length = RECORD_HEAD.unpack_from(data, position)
        begin = position + RECORD_HEAD.size
        if begin + length > len(data):
            raise ValueError('a record is cut short')
        yield position, opcode, data[begin : begin + length]
        position = begin + length


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


@dataclass
class ChunkTotals:
    """What the summary tells of the chunks, gathered as they come: some 230 bytes of each.

    Attributes:
        chunks: How many there are.
        records: Their index records.
        counts: Messages by channel.
        first_ns: Earliest message.
        last_ns: Latest message.
    """

    chunks: int = 0
    records: bytearray = field(default_factory=bytearray)
    counts: dict[int, int] = field(default_factory=dict)
    first_ns: int = INFINITE_NS
    last_ns: int = 0

    @classmethod
    def of(cls, chunks: Iterable[ChunkInfo]) -> ChunkTotals:
        """Return the totals of chunks."""
        totals = cls()
        for chunk in chunks:
            totals.add(chunk)
        return totals

    def add(self, chunk: ChunkInfo) -> None:
        """Count a chunk that is in the file."""
        self.chunks += 1
        self.records += chunk.index_record()
        for channel, count in chunk.counts.items():
            self.counts[channel] = self.counts.get(channel, 0) + count
        if chunk.counts:
            self.first_ns = min(self.first_ns, chunk.first_ns)
            self.last_ns = max(self.last_ns, chunk.last_ns)

    def statistics(self, schemas: int, channels: int) -> bytes:
        """Return the statistics record."""
        first_ns = self.first_ns if self.counts else 0
        total = sum(self.counts.values())
        return record(
            Opcode.STATISTICS,
            struct.pack('<QHIIII', total, schemas, channels, 0, 1, self.chunks),
            struct.pack('<QQ', first_ns, self.last_ns),
            number_map(self.counts.items()),
        )


def tail(
    position: int,
    *,
    schemas: Sequence[bytes],
    channels: Sequence[bytes],
    totals: ChunkTotals,
    metadata: str,
) -> bytes:
    """Return all that follows the last chunk: metadata, end of data, summary, footer.

    Args:
        position: Where it will lie in the file.
        schemas: The schema records of the file.
        channels: Its channel records.
        totals: Of its chunks.
        metadata: The bag's summary as YAML.
    """
    kept = record(Opcode.METADATA, text('rosbag2'), text_map({'serialized_metadata': metadata}))
    data_end = record(Opcode.DATA_END, struct.pack('<I', 0))
    summary_start = position + len(kept) + len(data_end)
    place = record(Opcode.METADATA_INDEX, struct.pack('<QQ', position, len(kept)), text('rosbag2'))
    groups = {
        Opcode.SCHEMA: b''.join(schemas),
        Opcode.CHANNEL: b''.join(channels),
        Opcode.CHUNK_INDEX: bytes(totals.records),
        Opcode.METADATA_INDEX: place,
        Opcode.STATISTICS: totals.statistics(len(schemas), len(channels)),
    }
    offsets, at = [], summary_start
    for opcode, data in groups.items():
        if data:
            offsets.append(
                record(Opcode.SUMMARY_OFFSET, struct.pack('<BQQ', opcode, at, len(data)))
            )
        at += len(data)
    head = RECORD_HEAD.pack(Opcode.FOOTER, 20) + struct.pack('<QQ', summary_start, at)
    summary = b''.join((*groups.values(), *offsets, head))
    return b''.join((kept, data_end, summary, struct.pack('<I', crc32(summary)), MAGIC))


_CHUNK_BYTES: Final = 768 * 1024
"""Size of a chunk, that of rosbag2's writer."""

_SUMMARY_PER_CHUNK: Final = 400
"""Bytes that a chunk adds to the summary, generously: 10 for each topic in it, and 90."""


class McapWriter:
    """A `StorageFile` in the MCAP format.

    Args:
        path: The file, which must not exist.
        zstd: Whether to compress chunks.
    """

    def __init__(self, path: Path, *, zstd: bool) -> None:
        self._path = path
        self._compression = 'zstd' if zstd else ''
        self._stream = path.open('xb', buffering=0)
        self._position = 0
        self._schemas: dict[str, bytes] = {}
        self._channels: dict[int, bytes] = {}
        self._totals = ChunkTotals()
        self._chunk = OpenChunk()
        self._append(header_record())

    @property
    def size(self) -> int:
        """Bytes so far, those in memory included."""
        return self._position + self._chunk.size

    @property
    def wants_flush(self) -> bool:
        """Whether the open chunk is full."""
        return self._chunk.size >= _CHUNK_BYTES

    def add_topic(self, number: int, topic: BagTopic) -> None:
        """Add schema and channel of a topic."""
        names = list(self._schemas)
        if topic.type_name not in self._schemas:
            names.append(topic.type_name)
            self._schemas[topic.type_name] = schema_record(len(names), topic)
            self._chunk.add_record(self._schemas[topic.type_name])
        schema = names.index(topic.type_name) + 1
        self._channels[number] = channel_record(number, schema, topic)
        self._chunk.add_record(self._channels[number])

    def write(self, number: int, time_ns: int, publish_ns: int, data: bytes) -> None:
        """Add a message to the open chunk."""
        self._chunk.add_message(number, time_ns, publish_ns, data)

    def flush(self) -> None:
        """Write the open chunk with its indexes."""
        chunk = self._chunk
        if not chunk.size:
            return
        stored = chunk.records()
        if self._compression:
            stored = compress(stored)
        head = chunk.chunk_head(self._compression, len(stored))
        length = len(head) + len(stored)
        summary = sum(map(len, self._schemas.values())) * 2
        room = length + summary + len(self._totals.records) + _SUMMARY_PER_CHUNK
        require_room(self._path, room)
        offset = self._position
        self._append(head, stored, *chunk.index_records().values())
        sizes = (len(stored), chunk.size)
        self._totals.add(chunk.placed(offset, length, self._compression, sizes))
        self._chunk = OpenChunk()

    def drop_pending(self) -> None:
        """Forget the open chunk; what it alone knew of topics comes with the summary."""
        self._chunk = OpenChunk()

    def finish(self, metadata: str) -> None:
        """Write the last chunk and the summary."""
        self.flush()
        data = tail(
            self._position,
            schemas=list(self._schemas.values()),
            channels=list(self._channels.values()),
            totals=self._totals,
            metadata=metadata,
        )
        self._append(data)
        self.close()

    def close(self) -> None:
        """Close the file as it is."""
        self._stream.close()

    def _append(self, *parts: bytes) -> None:
        """Write at the end, wholly or not at all."""
        try:
            for part in parts:
                rest = memoryview(part)
                while rest:
                    rest = rest[self._stream.write(rest) :]
        except OSError:
            self._stream.truncate(self._position)
            self._stream.seek(self._position)
            raise
        self._position += sum(map(len, parts))
