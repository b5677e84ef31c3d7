"""Giving an MCAP file the indexes and the summary that its writer did not come to write."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
import struct
from typing import BinaryIO, Final
from zlib import crc32

from goalreach_bags.mcap_file import (
    MAGIC,
    RECORD_HEAD,
    ChunkInfo,
    ChunkTotals,
    Opcode,
    OpenChunk,
    Reader,
    iterate_records,
    record,
    tail,
)
from goalreach_bags.topic import BagError, BagTopic, decompress, parse_offers

_FOOTER: Final = struct.Struct('<QQI')
_CHECKSUM_BYTES: Final = 4
_MAX_RECORD: Final = 1 << 32
"""A longer record is no record but a damaged length. Chosen: 4 GB."""


@dataclass(frozen=True, kw_only=True)
class ScannedChunk:
    """A chunk that is sound.

    Attributes:
        info: Where it lies; its indexes are those found after it.
        content: Its messages, for indexes that are missing.
        indexed: Whether all its indexes are there.
    """

    info: ChunkInfo
    content: OpenChunk
    indexed: bool


@dataclass
class McapScan:
    """What was found in a file.

    Attributes:
        path: The file.
        size: Its size.
        finished: Whether it goes on to its end as it should.
        body: Where the first chunk begins.
        end: Where its sound part ends.
        schemas: Schema records by number.
        channels: Channel records by number.
        topics: Topic of each channel.
        chunks: The chunks.
    """

    path: Path
    size: int
    finished: bool = False
    body: int = 0
    end: int = 0
    schemas: dict[int, bytes] = field(default_factory=dict)
    channels: dict[int, bytes] = field(default_factory=dict)
    topics: dict[int, BagTopic] = field(default_factory=dict)
    chunks: list[ScannedChunk] = field(default_factory=list)
    _types: dict[int, tuple[str, str, str]] = field(default_factory=dict)

    def counts(self) -> dict[str, int]:
        """Return the messages by topic name."""
        counts = {topic.name: 0 for topic in self.topics.values()}
        for chunk in self.chunks:
            for channel, count in chunk.info.counts.items():
                counts[self.topics[channel].name] += count
        return {name: count for name, count in counts.items() if count}

    def add_schema(self, content: memoryview) -> None:
        """Note a schema record."""
        reader = Reader(content)
        number, name, encoding = reader.u16(), reader.text(), reader.text()
        self._types[number] = name, encoding, str(reader.bytes(reader.u32()), 'utf-8')
        self.schemas[number] = record(Opcode.SCHEMA, bytes(content))

    def add_channel(self, content: memoryview) -> None:
        """Note a channel record."""
        reader = Reader(content)
        number, schema, name = reader.u16(), reader.u16(), reader.text()
        reader.text()
        values = reader.text_map()
        type_name, encoding, definition = self._types[schema]
        self.channels[number] = record(Opcode.CHANNEL, bytes(content))
        self.topics[number] = BagTopic(
            name=name,
            type_name=type_name,
            type_hash=values.get('topic_type_hash', ''),
            offers=parse_offers(values.get('offered_qos_profiles', '')),
            definition=definition,
            encoding=encoding,
        )


def is_unborn_mcap(path: Path) -> bool:
    """Return whether a file is the beginning of one that got no further than its magic bytes."""
    with path.open('rb') as stream:
        begin = stream.read(len(MAGIC))
    return len(begin) < len(MAGIC) and MAGIC.startswith(begin)


def scan_mcap(path: Path) -> McapScan:
    """Return what is sound in a file.

    Raises:
        BagError: It is no MCAP file, or one of another kind than rosbag2 writes.
    """
    scan = McapScan(path=path, size=path.stat().st_size)
    with path.open('rb') as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise BagError(path, 'is no MCAP file')
        scan.end = scan.body = stream.tell()
        try:
            while _scan_record(scan, stream):
                pass
        except (ValueError, KeyError, UnicodeDecodeError):
            pass  # what follows is not sound: the scan ends here
    return scan


def _scan_record(scan: McapScan, stream: BinaryIO) -> bool:
    """Read one record; return whether the file goes on."""
    offset = stream.tell()
    head = stream.read(RECORD_HEAD.size)
    if len(head) < RECORD_HEAD.size:
        return False
    opcode, length = RECORD_HEAD.unpack(head)
    if opcode == Opcode.DATA_END:
        scan.finished = _ends_well(scan, stream)
        return False
    if length > min(_MAX_RECORD, scan.size - stream.tell()):
        return False
    content = memoryview(stream.read(length))
    if opcode == Opcode.MESSAGE:
        raise BagError(scan.path, 'holds messages outside of chunks: not a file of rosbag2')
    if _take(scan, opcode, content, offset):
        scan.end = stream.tell()
        if not scan.chunks:
            scan.body = scan.end
    return True


def _take(scan: McapScan, opcode: int, content: memoryview, offset: int) -> bool:
    """Note a record; return whether it belongs to what is kept."""
    if opcode == Opcode.CHUNK:
        scan.chunks.append(_read_chunk(scan, content, offset))
    elif opcode == Opcode.MESSAGE_INDEX:
        _add_index(scan, Reader(content).u16(), offset, RECORD_HEAD.size + len(content))
    elif opcode == Opcode.SCHEMA:
        scan.add_schema(content)
    elif opcode == Opcode.CHANNEL:
        scan.add_channel(content)
    else:
        return opcode == Opcode.HEADER
    return True


def _ends_well(scan: McapScan, stream: BinaryIO) -> bool:
    """Return whether indexes, summary and footer are there, and the summary is as written."""
    stream.seek(max(0, scan.size - _FOOTER.size - len(MAGIC)))
    footer = stream.read(_FOOTER.size)
    if stream.read() != MAGIC or len(footer) < _FOOTER.size:
        return False
    start, _, checksum = _FOOTER.unpack(footer)
    if checksum:
        stream.seek(min(start, scan.size))
        summary = stream.read(max(0, scan.size - len(MAGIC) - _CHECKSUM_BYTES - start))
        if crc32(summary) != checksum:
            return False
    return all(chunk.indexed for chunk in scan.chunks)


def _read_chunk(scan: McapScan, content: memoryview, offset: int) -> ScannedChunk:
    """Read a chunk and check it.

    Raises:
        ValueError: It is not sound.
    """
    reader = Reader(content)
    reader.u64(), reader.u64()
    size, checksum, compression = reader.u64(), reader.u32(), reader.text()
    stored = reader.bytes(reader.u64())
    if compression not in ('', 'zstd'):
        raise BagError(scan.path, f'is compressed with {compression}, which is not known here')
    records = decompress(bytes(stored)) if compression else bytes(stored)
    if len(records) != size or (checksum and crc32(records) != checksum):
        raise ValueError('the check sum of a chunk is wrong')
    chunk = OpenChunk()
    for position, opcode, inner in iterate_records(memoryview(records)):
        if opcode == Opcode.SCHEMA:
            scan.add_schema(inner)
        elif opcode == Opcode.CHANNEL:
            scan.add_channel(inner)
        elif opcode == Opcode.MESSAGE:
            message = Reader(inner)
            channel = message.u16()
            message.u32()
            scan.topics[channel]
            chunk.note(channel, message.u64(), position)
    length = RECORD_HEAD.size + len(content)
    info = chunk.placed(offset, length, compression, (len(stored), len(records)))
    bare = _with_indexes(info, {}, 0)
    return ScannedChunk(info=bare, content=chunk, indexed=not chunk.entries)


def _add_index(scan: McapScan, channel: int, offset: int, length: int) -> None:
    """Note an index that follows its chunk."""
    chunk = scan.chunks[-1] if scan.chunks else None
    if chunk is None or channel not in chunk.content.entries:
        return
    info = chunk.info
    indexes = {**info.indexes, channel: offset}
    scan.chunks[-1] = ScannedChunk(
        info=_with_indexes(info, indexes, info.index_length + length),
        content=chunk.content,
        indexed=indexes.keys() == chunk.content.entries.keys(),
    )


def _with_indexes(info: ChunkInfo, indexes: dict[int, int], length: int) -> ChunkInfo:
    return ChunkInfo(
        offset=info.offset,
        length=info.length,
        indexes=indexes,
        index_length=length,
        counts=info.counts,
        first_ns=info.first_ns,
        last_ns=info.last_ns,
        compression=info.compression,
        sizes=info.sizes,
    )


def repair_mcap(scan: McapScan, metadata: str) -> None:
    """Cut off what is not sound, and end the file as it should.

    Where only the last chunk lacks indexes they are added in place; a file whose chunks in the
    middle lack them is written anew beside the old one, which it then replaces.

    Args:
        scan: What is sound in it.
        metadata: The bag's summary.

    Raises:
        OSError: The disk takes no more.
    """
    if all(chunk.indexed for chunk in scan.chunks[:-1]):
        _finish_in_place(scan, metadata)
    else:
        _write_anew(scan, metadata)


def _finish_in_place(scan: McapScan, metadata: str) -> None:
    chunks = [chunk.info for chunk in scan.chunks]
    position, missing = scan.end, b''
    if scan.chunks and not scan.chunks[-1].indexed:
        last = scan.chunks[-1]
        position = last.info.offset + last.info.length
        missing = b''.join(last.content.index_records().values())
        chunks[-1] = _placed(scan, len(chunks) - 1, last.info.offset)
    with scan.path.open('r+b') as stream:
        stream.truncate(position)
        stream.seek(position)
        stream.write(missing + _tail(scan, chunks, position + len(missing), metadata))


def _write_anew(scan: McapScan, metadata: str) -> None:
    path = scan.path.with_suffix('.mcap.repair')
    with scan.path.open('rb') as old, path.open('wb') as new:
        new.write(old.read(scan.body))
        chunks = []
        for index, chunk in enumerate(scan.chunks):
            old.seek(chunk.info.offset)
            chunks.append(_placed(scan, index, new.tell()))
            new.write(old.read(chunk.info.length))
            new.write(b''.join(chunk.content.index_records().values()))
        new.write(_tail(scan, chunks, new.tell(), metadata))
    Path(path).replace(scan.path)


def _placed(scan: McapScan, index: int, offset: int) -> ChunkInfo:
    chunk = scan.chunks[index]
    info = chunk.info
    return chunk.content.placed(offset, info.length, info.compression, info.sizes)


def _tail(scan: McapScan, chunks: list[ChunkInfo], position: int, metadata: str) -> bytes:
    return tail(
        position,
        schemas=list(scan.schemas.values()),
        channels=list(scan.channels.values()),
        totals=ChunkTotals.of(chunks),
        metadata=metadata,
    )
