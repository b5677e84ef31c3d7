"""Reading what is sound in a damaged MCAP file, and writing that to a new one.

The `mcap` package reads and writes records. Its readers end at the first damage, take a record
that is cut short for a whole one and skip records of unknown kinds, so records are separated here.
After a record whose length is damaged, reading continues at the next chunk.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from mmap import ACCESS_READ, mmap
from pathlib import Path
import re
import struct
from typing import BinaryIO, Final
from zlib import crc32

from mcap.data_stream import RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer
import zstandard

from goalreach_bags.metadata import ROS_DISTRO
from goalreach_bags.storage import NOT_CLOSED, ZSTD_MAGIC, BagError, FileSpan, StorageScan
from goalreach_bags.topic import BagTopic, parse_offers

MAGIC: Final = b'\x89MCAP0\r\n'
LIBRARY: Final = 'goalreach'
BAG_METADATA: Final = 'rosbag2'
"""Name of the record that holds a copy of the bag's metadata."""

COPY_KEY: Final = 'serialized_metadata'
_HEAD: Final = struct.Struct('<BQ')
_FOOTER: Final = struct.Struct('<BQQQI')
_FOOTER_HEAD: Final = _HEAD.pack(Opcode.FOOTER, _FOOTER.size - _HEAD.size)
_CRC_BYTES: Final = 4
_COMPRESSIONS: Final = {
    '': CompressionType.NONE,
    'lz4': CompressionType.LZ4,
    'zstd': CompressionType.ZSTD,
}
_KNOWN: Final = frozenset(Opcode)
_CHUNK_HEAD_BYTES: Final = 53
_CHUNK: Final = re.compile(
    rb'\x06(.{8}).{28}(?:\0{4}|\x03\0{3}lz4|\x04\0{3}zstd)(.{8})', re.DOTALL
)
"""Head of a chunk: its length, times, check sum and compression, and the length of its records."""

_DAMAGE: Final = (
    McapError, zstandard.ZstdError, KeyError, MemoryError, OverflowError, RuntimeError, ValueError,
    struct.error,
)  # fmt: skip
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


@dataclass(kw_only=True)
class McapScan(StorageScan):
    """Result of reading an MCAP file record by record."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    _header: Header = field(default_factory=lambda: Header(profile='ros2', library=''))
    _compression: str = ''
    _chunks: dict[int, set[int]] = field(default_factory=dict)
    _indexed: dict[int, set[int]] = field(default_factory=dict)
    _described: set[tuple[Opcode, int]] = field(default_factory=set)

    def write_repaired(self, target: Path, metadata: str) -> None:
        """Write the sound records to a new file, with a new summary too."""
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
                self.compressed |= record.data.startswith(ZSTD_MAGIC)
                self.span.add(self.channels[record.channel_id].topic, record.log_time)
            elif isinstance(record, Metadata) and record.name == BAG_METADATA:
                self.metadata = record.metadata.get(COPY_KEY, '')
        found = self.span.message_count
        if not self.problems and promised not in (None, found):
            self._add_problem(f'its statistics promise {promised} messages and {found} are there')
        self._compare_index()
        self.indexed = bool(self._indexed)
        self.topics = tuple(channel_topic(c, self.schemas) for c in self.channels.values())

    def _compare_index(self) -> None:
        """Compare the index with the chunks; an entry may leave out all channels, but not some."""
        index, chunks, known = self._indexed, self._chunks, self.channels.keys()
        missing = sum(not used <= (index.get(at, set()) or known) for at, used in chunks.items())
        missing += len(chunks.keys() - index.keys())
        wrong = sum(at not in chunks or not named <= known for at, named in index.items())
        if index and (missing or wrong):
            self._add_problem(f'{missing} chunks have no index, {wrong} indexes have no chunk')

    def _add_problem(self, problem: str) -> None:
        self.problems[problem] = None

    def _read_summary(self, stream: BinaryIO) -> int | None:
        """Check the end of the file; return the number of messages that the summary counts."""
        size = stream.seek(0, 2)
        end = size - len(MAGIC) - _FOOTER.size
        stream.seek(max(0, end))
        tail = stream.read()
        if end < 0 or not tail.endswith(MAGIC) or not tail.startswith(_FOOTER_HEAD):
            self._add_problem(f'no footer: {NOT_CLOSED}')
            return None
        _, _, start, _, checksum = _FOOTER.unpack_from(tail)
        stream.seek(min(start or end, end))
        if checksum and crc32(stream.read()[: -_CRC_BYTES - len(MAGIC)]) != checksum:
            self._add_problem('the CRC of its summary is wrong')
            return None
        try:
            if start > end:
                raise ValueError('it begins after its end')
            stream.seek(0)
            summary = make_reader(stream).get_summary()
        except _DAMAGE as error:
            self._add_problem(f'its summary cannot be read: {str(error) or type(error).__name__}')
            return None
        if summary is None:
            return None
        self.schemas.update(summary.schemas)
        self.channels.update(summary.channels)
        for index in summary.chunk_indexes:
            self._indexed[index.chunk_start_offset] = set(index.message_index_offsets)
        return summary.statistics.message_count if summary.statistics else None

    def _sound_records(self) -> Iterator[McapRecord | bytes]:
        """Yield the sound records of the file and of its chunks, unknown ones as bytes."""
        self.dropped_bytes = 0
        self._chunks.clear()
        with self.path.open('rb') as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as data:
            offset = chunk = len(MAGIC)
            stop = len(data) - (offset if data[-offset:] == MAGIC else 0)
            while offset < stop:
                end, name = _record_end(data, offset), 'record'
                if data[offset] == Opcode.CHUNK:
                    self._chunks[offset] = set()
                    name = f'chunk {len(self._chunks)}'
                try:
                    records = self._parse(data, offset, end)
                except _DAMAGE as error:
                    if chunk <= offset:
                        chunk = _find_chunk(data, offset + 1, len(data))
                    agrees = _find_chunk(data, offset, offset + 1) == offset
                    end = min(end, chunk) if agrees or _is_record(data, end) else chunk
                    if end < stop or not self.problems:
                        reason = str(error) or type(error).__name__
                        self._add_problem(f'{name} at byte {offset}: {reason}')
                    self.dropped_bytes += end - offset
                else:
                    yield from records
                offset = end

    def _parse(self, data: mmap, offset: int, end: int) -> Sequence[McapRecord | bytes]:
        """Return a record, or all records of a chunk, and remember schemas and channels."""
        content = data[offset:end]
        if end > len(data) or not content[0]:
            raise ValueError('a record that is cut short')
        if content[0] not in _KNOWN:
            if _find_chunk(data, offset, end) < end and not _is_record(data, end):
                raise ValueError('a record that runs into a chunk')
            return [content]
        reader = StreamReader(BytesIO(content), skip_magic=True, emit_chunks=True)
        record = next(reader.records)
        builder = RecordBuilder()
        record.write(builder)
        again = bytes(builder.end())[_HEAD.size :]  # type: ignore[no-untyped-call]
        if content[0] == Opcode.DATA_END:
            again = crc32(memoryview(data)[:offset]).to_bytes(_CRC_BYTES, 'little')
        without_checksum = again[:-_CRC_BYTES] + bytes(_CRC_BYTES)
        if not content.startswith((again, without_checksum), _HEAD.size):
            raise ValueError('a wrong length or check sum')
        if _find_chunk(data, offset + _HEAD.size + len(again), end) < end:
            raise ValueError('a record that runs into a chunk')
        records = [record]
        if isinstance(record, Chunk):
            records = self._parse_chunk(record, data)
        used = self._remember(records)
        if used and (self._indexed or isinstance(record, Chunk)):
            self._chunks[offset] = used
        return records

    def _parse_chunk(self, chunk: Chunk, data: mmap) -> list[McapRecord]:
        if chunk.compression not in _COMPRESSIONS:
            if _find_chunk(data, 0, len(data)) < len(data):
                raise ValueError('a compression unlike that of other chunks')
            problem = f'compression {chunk.compression!r} of its chunks is not known'
            raise BagError(self.path, f'{problem}: lz4 and zstd are')
        if not chunk.compression and len(chunk.data) != chunk.uncompressed_size:
            raise ValueError('a chunk is not of the size that it names')
        records = breakup_chunk(chunk, validate_crc=True)
        self._compression = chunk.compression
        return records

    def _remember(self, records: list[McapRecord]) -> set[int]:
        """Remember schemas and channels, new ones if they are lost; return those of messages."""
        for record in records:
            if isinstance(record, Schema):
                self._described.add((Opcode.SCHEMA, record.id))
                if self.schemas.setdefault(record.id, record) != record:
                    self._add_problem(f'schema {record.id} is described in two ways')
            elif isinstance(record, Channel):
                self._described |= {(Opcode.CHANNEL, record.id), (Opcode.SCHEMA, 0)}
                if self.channels.setdefault(record.id, record) != record:
                    self._add_problem(f'channel {record.id} is described in two ways')
                if (Opcode.SCHEMA, record.schema_id) not in self._described:
                    self._add_problem(f'schema {record.schema_id} is lost')
        used = {record.channel_id for record in records if isinstance(record, Message)}
        for number in used:
            if (Opcode.CHANNEL, number) not in self._described:
                self._add_problem(f'channel {number} is lost')
                self.channels.setdefault(number, Channel(number, f'/unknown_{number}', '', {}, 0))
        return used


def _record_end(data: mmap, offset: int) -> int:
    """Return where a record says that it ends; after the end of the file if it is cut short."""
    if offset + _HEAD.size > len(data):
        return len(data) + 1
    return int(offset + _HEAD.size + _HEAD.unpack_from(data, offset)[1])


def _is_record(data: mmap, offset: int) -> bool:
    """Return whether a record of a known kind begins at a place, and the file holds it whole."""
    return offset < len(data) and data[offset] in _KNOWN and _record_end(data, offset) <= len(data)


def _find_chunk(data: mmap, start: int, stop: int) -> int:
    """Return where the next chunk begins, all of whose lengths agree; `stop` if there is none."""
    while start < stop and (found := _CHUNK.search(data, start, stop + _CHUNK_HEAD_BYTES)):
        (length,), (size,) = struct.unpack('<Q', found[1]), struct.unpack('<Q', found[2])
        end = found.start() + _HEAD.size + length
        if found.end() + size == end <= len(data):
            return min(found.start(), stop)
        start = found.start() + 1
    return stop


def scan_mcap(path: Path) -> McapScan:
    """Read a file whole, and find what of it is sound.

    Raises:
        BagError: It is no MCAP file, or compressed in a way that is not known here.
    """
    with path.open('rb') as stream:
        begin = stream.read(len(MAGIC))
        stream.seek(max(0, stream.seek(0, 2) - len(MAGIC)))
        if MAGIC not in (begin, stream.read()):
            raise BagError(path, 'is no MCAP file')
    scan = McapScan(path=path, span=FileSpan(name=path.name))
    if begin != MAGIC:
        scan.problems['its first bytes are not those of an MCAP file'] = None
    scan.read()
    return scan
