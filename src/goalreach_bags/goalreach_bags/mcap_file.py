"""MCAP files: written chunk by chunk, so that a finished chunk survives the process; and read."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
import struct
from typing import Final
from zlib import crc32

from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.summary import Summary
import zstandard

from goalreach_bags.mcap_repair import (
    BAG_METADATA,
    COPY_KEY,
    LIBRARY,
    MAGIC,
    channel_topic,
    encode,
    scan_mcap,
)
from goalreach_bags.storage import ZSTD_LEVEL, FileSpan, require_free_space
from goalreach_bags.topic import BagTopic, offers_to_text

_MESSAGE: Final = struct.Struct('<BQHIQQ')
_MESSAGE_FIELDS: Final = 22
_CRC_BYTES: Final = 4
_CHUNK_BYTES: Final = 768 * 1024
"""Size of a chunk, that of rosbag2's writer."""

_SUMMARY_PER_CHUNK: Final = 400
"""Upper estimate of the bytes that a chunk adds to the summary: 10 for each topic, and 90."""


@dataclass
class ChunkBuffer:
    """The chunk that is being filled in memory.

    `mcap`'s writer is as fast, but it cannot discard a chunk for which the disk has no space, and
    it keeps an object of 2 KB for each chunk.

    Attributes:
        size: Bytes of its records so far.
        indexes: Time and offset of each message by channel.
        first_ns: Earliest message; 0 while there is none.
        last_ns: Latest message.
    """

    size: int = 0
    indexes: dict[int, records.MessageIndex] = field(default_factory=dict)
    first_ns: int = 0
    last_ns: int = 0
    _parts: list[bytes] = field(default_factory=list)

    def add_record(self, data: bytes) -> None:
        """Add an encoded schema or channel."""
        self._parts.append(data)
        self.size += len(data)

    def add_message(self, channel: int, time_ns: int, publish_ns: int, data: bytes) -> None:
        """Add a message."""
        self.first_ns = min(self.first_ns, time_ns) if self.indexes else time_ns
        self.last_ns = max(self.last_ns, time_ns)
        if channel not in self.indexes:
            self.indexes[channel] = records.MessageIndex(channel_id=channel, records=[])
        self.indexes[channel].records.append((time_ns, self.size))
        length = _MESSAGE_FIELDS + len(data)
        head = _MESSAGE.pack(Opcode.MESSAGE, length, channel, 0, time_ns, publish_ns)
        self._parts += (head, data)
        self.size += len(head) + len(data)

    def to_chunk(self, compression: str) -> records.Chunk:
        """Return the chunk's record, with a check sum of the uncompressed records.

        Args:
            compression: 'zstd' or empty.
        """
        data = b''.join(self._parts)
        return records.Chunk(
            compression=compression,
            data=zstandard.compress(data, ZSTD_LEVEL) if compression else data,
            message_end_time=self.last_ns,
            message_start_time=self.first_ns,
            uncompressed_crc=crc32(data),
            uncompressed_size=len(data),
        )

    def encode_indexes(self, position: int) -> tuple[dict[int, int], bytes]:
        """Return the message indexes, and before them the offset of each channel's in the file.

        Args:
            position: Where in the file they will be stored.
        """
        builder, offsets = RecordBuilder(), {}
        for channel, index in self.indexes.items():
            offsets[channel] = position + builder.count
            index.write(builder)
        return offsets, bytes(builder.end())  # type: ignore[no-untyped-call]


def _encode_end(position: int, summary: Mapping[Opcode, bytearray], metadata: str) -> bytes:
    """Return all that follows the last chunk: metadata, summary and footer.

    Args:
        position: Where in the file it will be stored.
        summary: Encoded records that the summary holds, by kind.
        metadata: Metadata of the bag, of which the file keeps a copy.
    """
    copy = encode(records.Metadata(name=BAG_METADATA, metadata={COPY_KEY: metadata}))
    data_end = encode(records.DataEnd(data_section_crc=0))
    index = records.MetadataIndex(offset=position, length=len(copy), name=BAG_METADATA)
    groups: dict[Opcode, bytes | bytearray] = {
        Opcode.SCHEMA: summary[Opcode.SCHEMA],
        Opcode.CHANNEL: summary[Opcode.CHANNEL],
        Opcode.CHUNK_INDEX: summary[Opcode.CHUNK_INDEX],
        Opcode.METADATA_INDEX: encode(index),
        Opcode.STATISTICS: summary[Opcode.STATISTICS],
    }
    start = summary_start = position + len(copy) + len(data_end)
    offsets: list[records.McapRecord] = []
    for opcode, data in groups.items():
        if data:
            offsets.append(
                records.SummaryOffset(opcode, group_start=start, group_length=len(data))
            )
            start += len(data)
    content = b''.join((*groups.values(), encode(*offsets)))
    footer = records.Footer(summary_start=summary_start, summary_offset_start=start, summary_crc=0)
    footer.summary_crc = crc32(content + encode(footer)[:-_CRC_BYTES])
    return b''.join((copy, data_end, content, encode(footer), MAGIC))


class McapWriter:
    """One MCAP file of a bag being written.

    What has been flushed survives the death of the process. Every method may raise OSError; the
    file then still ends after what was flushed before.

    Args:
        path: The file, which must not exist.
        zstd: Whether to compress chunks.
    """

    def __init__(self, path: Path, *, zstd: bool) -> None:
        self._path = path
        self._compression = 'zstd' if zstd else ''
        self._stream = path.open('xb', buffering=0)
        self._position = 0
        self._schemas: dict[str, int] = {}
        # Kept encoded: a chunk's index takes 230 bytes, a tenth of what the object takes.
        self._summary = {
            kind: bytearray() for kind in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.CHUNK_INDEX)
        }
        self._statistics = records.Statistics(
            attachment_count=0,
            channel_count=0,
            channel_message_counts={},
            chunk_count=0,
            message_count=0,
            message_end_time=0,
            message_start_time=0,
            metadata_count=1,
            schema_count=0,
        )
        self._chunk = ChunkBuffer()
        self._append(MAGIC + encode(records.Header(profile='ros2', library=LIBRARY)))

    @property
    def size(self) -> int:
        """Bytes so far, those in memory included."""
        return self._position + self._chunk.size

    @property
    def wants_flush(self) -> bool:
        """Whether the chunk is full."""
        return self._chunk.size >= _CHUNK_BYTES

    def add_topic(self, number: int, topic: BagTopic) -> None:
        """Add schema and channel of a topic, with the metadata that rosbag2 keeps."""
        if topic.type_name not in self._schemas:
            self._schemas[topic.type_name] = len(self._schemas) + 1
            schema = records.Schema(
                id=self._schemas[topic.type_name],
                data=topic.definition.encode(),
                encoding=topic.encoding,
                name=topic.type_name,
            )
            self._statistics.schema_count += 1
            self._add_record(Opcode.SCHEMA, schema)
        channel = records.Channel(
            id=number,
            topic=topic.name,
            message_encoding='cdr',
            metadata={
                'offered_qos_profiles': offers_to_text(topic.offers),
                'topic_type_hash': topic.type_hash,
            },
            schema_id=self._schemas[topic.type_name],
        )
        self._statistics.channel_count += 1
        self._add_record(Opcode.CHANNEL, channel)

    def _add_record(self, kind: Opcode, record: records.McapRecord) -> None:
        data = encode(record)
        self._summary[kind] += data
        self._chunk.add_record(data)

    def write(self, number: int, time_ns: int, publish_ns: int, data: bytes) -> None:
        """Add a message to the chunk."""
        self._chunk.add_message(number, time_ns, publish_ns, data)

    def flush(self) -> None:
        """Write the chunk with its message indexes."""
        if not self._chunk.size:
            return
        chunk = self._chunk.to_chunk(self._compression)
        data = encode(chunk)
        summary = sum(map(len, self._summary.values()))
        require_free_space(self._path, len(data) + summary + _SUMMARY_PER_CHUNK)
        offset = self._position
        offsets, indexes = self._chunk.encode_indexes(offset + len(data))
        self._append(data, indexes)
        index = records.ChunkIndex(
            chunk_length=len(data),
            chunk_start_offset=offset,
            compression=chunk.compression,
            compressed_size=len(chunk.data),
            message_end_time=chunk.message_end_time,
            message_index_length=len(indexes),
            message_index_offsets=offsets,
            message_start_time=chunk.message_start_time,
            uncompressed_size=chunk.uncompressed_size,
        )
        self._summary[Opcode.CHUNK_INDEX] += encode(index)
        self._count(self._chunk)
        self._chunk = ChunkBuffer()

    def _count(self, chunk: ChunkBuffer) -> None:
        """Count a chunk that is in the file."""
        total = self._statistics
        total.chunk_count += 1
        if chunk.indexes:
            first_ns = min(total.message_start_time, chunk.first_ns)
            total.message_start_time = first_ns if total.message_count else chunk.first_ns
            total.message_end_time = max(total.message_end_time, chunk.last_ns)
        for channel, index in chunk.indexes.items():
            counts, count = total.channel_message_counts, len(index.records)
            counts[channel] = counts.get(channel, 0) + count
            total.message_count += count

    def drop_pending(self) -> None:
        """Discard the chunk; the summary still holds its schemas and channels."""
        self._chunk = ChunkBuffer()

    def finish(self, metadata: str) -> None:
        """Write the last chunk, the bag's metadata and the summary."""
        self.flush()
        summary = {**self._summary, Opcode.STATISTICS: bytearray(encode(self._statistics))}
        self._append(_encode_end(self._position, summary, metadata))
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


def _is_complete(summary: Summary, total: records.Statistics) -> bool:
    """Return whether a summary describes all channels and counts all messages."""
    counts, schemas = total.channel_message_counts, {0, *summary.schemas}
    return (
        total.channel_count == len(summary.channels)
        and total.message_count == sum(counts.values())
        and counts.keys() <= summary.channels.keys()
        and all(channel.schema_id in schemas for channel in summary.channels.values())
    )


class McapReader:
    """One MCAP file open for reading.

    Attributes:
        topics: Its topics.
        span: Its messages by number and time.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self._stream = path.open('rb')
        try:
            self._reader = make_reader(self._stream, validate_crcs=True)
            summary = self._reader.get_summary()
            total = None if summary is None else summary.statistics
            if summary and total and _is_complete(summary, total):
                channels = summary.channels.values()
                self.topics = tuple(channel_topic(c, summary.schemas) for c in channels)
                self.span = FileSpan(name=path.name)
                for number, count in total.channel_message_counts.items():
                    self.span.counts[summary.channels[number].topic] += count
                if self.span.message_count:
                    self.span.first_ns = total.message_start_time
                    self.span.last_ns = total.message_end_time
            else:
                scan = scan_mcap(path)
                self.topics, self.span = scan.topics, scan.span
                if summary:  # mcap's reader looks up in it what need not be repeated there
                    summary.schemas.update(scan.schemas)
                    summary.channels.update(scan.channels)
        except BaseException:
            self._stream.close()
            raise

    def messages(
        self, topics: Collection[str], start_ns: int | None, stop_ns: int | None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, receive time and data in the order of receive time.

        Args:
            topics: Names of topics.
            start_ns: Earliest receive time, or None.
            stop_ns: Receive time before which messages must lie, or None.
        """
        found = self._reader.iter_messages(topics, starting_at=start_ns, ending_before=stop_ns)
        for _, channel, message in found:
            yield channel.topic, message.log_time, message.data

    def close(self) -> None:
        """Close it."""
        self._stream.close()
