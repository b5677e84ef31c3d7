"""The summary at the end of an MCAP file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
import struct
from zlib import crc32

from goalreach_bringup.bags.mcap_layout import ChunkInfo
from goalreach_bringup.bags.mcap_records import (
    MAGIC,
    RECORD_HEAD,
    Opcode,
    number_map,
    record,
    text,
    text_map,
)
from goalreach_bringup.bags.topic import INFINITE_NS

__all__ = ['ChunkTotals', 'tail']


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
