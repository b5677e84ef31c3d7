"""Reading what is sound in a damaged MCAP file, and writing that to a new one.

The `mcap` package reads and writes records. Its readers end at the first damage, take a record
that is cut short for a whole one and skip records of unknown kinds, so records are separated here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
import struct
from typing import BinaryIO, Final
from zlib import crc32

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer
import zstandard

from goalreach_bags.metadata import ROS_DISTRO
from goalreach_bags.storage import NOT_CLOSED, BagError, FileSpan
from goalreach_bags.topic import BagTopic, parse_offers

MAGIC: Final = b'\x89MCAP0\r\n'
LIBRARY: Final = 'goalreach'
BAG_METADATA: Final = 'rosbag2'
"""Name of the record that holds a copy of the bag's metadata."""

COPY_KEY: Final = 'serialized_metadata'
_HEAD: Final = struct.Struct('<BQ')
_FOOTER: Final = struct.Struct('<BQQQI')
_CRC_BYTES: Final = 4
_COMPRESSIONS: Final = {
    '': CompressionType.NONE,
    'lz4': CompressionType.LZ4,
    'zstd': CompressionType.ZSTD,
}
_PROBLEMS: Final = 3
"""So many problems are shown; the others are counted."""

_KNOWN: Final = frozenset(Opcode)
_DAMAGE: Final = (
    McapError,
    zstandard.ZstdError,
    KeyError,
    MemoryError,
    OverflowError,
    RuntimeError,
    ValueError,
    struct.error,
)
"""Raised for a record that is not sound; RuntimeError by lz4."""


def channel_topic(channel: Channel, schemas: Mapping[int, Schema]) -> BagTopic:
    """Return the topic that a channel belongs to; without definition where it has no schema."""
    schema = schemas.get(channel.schema_id) or Schema(id=0, data=b'', encoding='', name='')
    return BagTopic(
        name=channel.topic,
        type_name=schema.name,
        type_hash=channel.metadata.get('topic_type_hash', ''),
        offers=parse_offers(channel.metadata.get('offered_qos_profiles', '')),
        definition=schema.data.decode(errors='replace'),
        encoding=schema.encoding,
        serialization=channel.message_encoding,
    )


@dataclass
class McapScan:
    """Result of reading an MCAP file record by record.

    Attributes:
        path: The file.
        span: Its sound messages.
        schemas: Schemas by number.
        channels: Channels by number.
        metadata: Copy of the bag's metadata, or empty.
        distro: ROS distribution, or empty.
        problems: Why the file needs repair; none for a sound file.
        dropped_bytes: Bytes of records that are not sound.
        compressed: Whether each message is compressed by itself: not in this format.
    """

    path: Path
    span: FileSpan
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: str = ''
    distro: str = ''
    problems: list[str] = field(default_factory=list)
    dropped_bytes: int = 0
    compressed: bool = False
    _header: Header = field(default_factory=lambda: Header(profile='ros2', library=''))
    _compression: str = ''
    _chunks: set[int] = field(default_factory=set)
    _indexed: set[int] = field(default_factory=set)

    @property
    def indexed(self) -> bool:
        """Whether its chunks, if it has any, can be found by an index."""
        return bool(self._indexed)

    @property
    def damage(self) -> str:
        """Why the file needs repair, on one line; empty for a sound file."""
        more = len(self.problems) - _PROBLEMS
        return '; '.join(self.problems[:_PROBLEMS]) + (f'; {more} more' if more > 0 else '')

    @property
    def topics(self) -> tuple[BagTopic, ...]:
        """Its topics."""
        return tuple(channel_topic(c, self.schemas) for c in self.channels.values())

    def write_repaired(self, target: Path, metadata: str) -> None:
        """Write the sound records to a new file, with new indexes and a new summary.

        Args:
            target: The file, which must not exist.
            metadata: Metadata of the bag, of which the file keeps a copy.

        Raises:
            OSError: It cannot be written.
        """
        with target.open('xb') as stream:
            writer = Writer(stream, compression=_COMPRESSIONS[self._compression])
            writer.start(profile=self._header.profile, library=self._header.library)
            schemas = {0: 0}
            for number, schema in self.schemas.items():
                schemas[number] = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels = {}
            for number, channel in self.channels.items():
                schema_id, encoding = schemas.get(channel.schema_id, 0), channel.message_encoding
                channels[number] = writer.register_channel(
                    channel.topic, encoding, schema_id, channel.metadata
                )
            for record in self._sound_records():
                if isinstance(record, Message):
                    record.channel_id = channels[record.channel_id]
                    writer.add_message(**vars(record))
                elif isinstance(record, Attachment):
                    writer.add_attachment(**vars(record))
                elif isinstance(record, Metadata) and record.name != BAG_METADATA:
                    writer.add_metadata(record.name, record.metadata)
                elif isinstance(record, bytes):
                    writer.flush()  # type: ignore[no-untyped-call]
                    stream.write(record)
            writer.add_metadata(BAG_METADATA, {COPY_KEY: metadata})
            writer.finish()  # type: ignore[no-untyped-call]

    def read(self) -> None:
        """Read the file; its summary first, for the channels that only the summary holds."""
        with self.path.open('rb') as stream:
            promised = self._read_summary(stream)
        for record in self._sound_records():
            if isinstance(record, Header):
                self._header = record
                self.distro = ROS_DISTRO if record.library == LIBRARY else ''
            elif isinstance(record, Message):
                self.span.add(self.channels[record.channel_id].topic, record.log_time)
            elif isinstance(record, Metadata) and record.name == BAG_METADATA:
                self.metadata = record.metadata.get(COPY_KEY, '')
        found = self.span.message_count
        if not self.problems and promised not in (None, found):
            self._add_problem(f'its statistics promise {promised} messages and {found} are there')
        if self._indexed and self._indexed != self._chunks:
            missing, wrong = len(self._chunks - self._indexed), len(self._indexed - self._chunks)
            self._add_problem(f'{missing} chunks have no index, {wrong} indexes have no chunk')

    def _add_problem(self, problem: str) -> None:
        if problem not in self.problems:
            self.problems.append(problem)

    def _read_summary(self, stream: BinaryIO) -> int | None:
        """Check the end of the file; return the number of messages that the summary counts."""
        size = stream.seek(0, 2)
        end = size - len(MAGIC) - _FOOTER.size
        stream.seek(max(0, end))
        tail = stream.read()
        if end < 0 or not tail.endswith(MAGIC) or tail[0] != Opcode.FOOTER:
            self._add_problem(f'no footer: {NOT_CLOSED}')
            return None
        _, _, start, _, checksum = _FOOTER.unpack_from(tail)
        stream.seek(min(start or end, end))
        if checksum and crc32(stream.read()[: -_CRC_BYTES - len(MAGIC)]) != checksum:
            self._add_problem('the CRC of its summary is wrong')
            return None
        try:
            stream.seek(0)
            summary = make_reader(stream).get_summary()
        except _DAMAGE as error:
            self._add_problem(f'its summary cannot be read: {str(error) or type(error).__name__}')
            return None
        if summary is None:
            return None
        self.schemas.update(summary.schemas)
        self.channels.update(summary.channels)
        self._indexed = {index.chunk_start_offset for index in summary.chunk_indexes}
        return summary.statistics.message_count if summary.statistics else None

    def _sound_records(self) -> Iterator[McapRecord | bytes]:
        """Yield the sound records of the data and of its chunks, unknown ones as bytes."""
        self.dropped_bytes = 0
        self._chunks.clear()
        size = self.path.stat().st_size
        with self.path.open('rb') as stream:
            end = stream.seek(len(MAGIC))
            for offset, opcode, content in _iterate_records(stream, size):
                if opcode in (Opcode.DATA_END, Opcode.FOOTER):
                    return
                end = offset + _HEAD.size + len(content)
                if opcode == Opcode.CHUNK:
                    self._chunks.add(offset)
                try:
                    yield from self._parse(opcode, content)
                except _DAMAGE as error:
                    record = f'chunk {len(self._chunks)}' if opcode == Opcode.CHUNK else 'record'
                    reason = str(error) or type(error).__name__
                    self._add_problem(f'{record} at byte {offset}: {reason}')
                    self.dropped_bytes += end - offset
            self.dropped_bytes += size - end

    def _parse(self, opcode: int, content: bytes) -> Sequence[McapRecord | bytes]:
        """Return a record, or all records of a chunk, and remember schemas and channels."""
        if opcode == Opcode.MESSAGE_INDEX:  # not needed, since indexes are written anew
            return []
        data = _HEAD.pack(opcode, len(content)) + content
        if opcode not in _KNOWN:
            return [data]
        stream = StreamReader(BytesIO(data), skip_magic=True, emit_chunks=True)
        record = next(stream.records)
        records = self._parse_chunk(record) if isinstance(record, Chunk) else [record]
        self._remember(records)
        return records

    def _parse_chunk(self, chunk: Chunk) -> list[McapRecord]:
        if chunk.compression not in _COMPRESSIONS:
            problem = f'compression {chunk.compression!r} of its chunks is not known'
            raise BagError(self.path, f'{problem}: lz4 and zstd are')
        self._compression = chunk.compression
        if not chunk.compression and len(chunk.data) != chunk.uncompressed_size:
            raise ValueError('a chunk is not of the size that it names')
        return breakup_chunk(chunk, validate_crc=True)

    def _remember(self, records: list[McapRecord]) -> None:
        schemas = {record.id: record for record in records if isinstance(record, Schema)}
        channels = {record.id: record for record in records if isinstance(record, Channel)}
        used = {record.channel_id for record in records if isinstance(record, Message)}
        if used - channels.keys() - self.channels.keys():
            raise ValueError('a message of an unknown channel')
        self.schemas.update(schemas)
        self.channels.update(channels)


def _iterate_records(stream: BinaryIO, size: int) -> Iterator[tuple[int, int, bytes]]:
    """Yield offset, opcode and content of each record, up to the first that is cut short."""
    offset = stream.tell()
    while offset + _HEAD.size <= size:
        opcode, length = _HEAD.unpack(stream.read(_HEAD.size))
        if not opcode or offset + _HEAD.size + length > size:
            return
        yield offset, opcode, stream.read(length)
        offset += _HEAD.size + length


def scan_mcap(path: Path) -> McapScan:
    """Read a file whole, and find what of it is sound.

    Raises:
        BagError: It is no MCAP file, or compressed in a way that is not known here.
    """
    with path.open('rb') as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise BagError(path, 'is no MCAP file')
    scan = McapScan(path=path, span=FileSpan(name=path.name))
    scan.read()
    return scan


def is_truncated_header(path: Path) -> bool:
    """Return whether a file ends within the magic bytes of an MCAP file."""
    with path.open('rb') as stream:
        begin = stream.read(len(MAGIC))
    return len(begin) < len(MAGIC) and MAGIC.startswith(begin)
