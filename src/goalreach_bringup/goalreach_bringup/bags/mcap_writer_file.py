"""Writing one MCAP file, chunk by chunk, so that a death at any moment loses no finished chunk."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from goalreach_bringup.bags.mcap_layout import (
    OpenChunk,
    channel_record,
    header_record,
    schema_record,
)
from goalreach_bringup.bags.mcap_summary import ChunkTotals, tail
from goalreach_bringup.bags.room import require_room
from goalreach_bringup.bags.topic import BagTopic
from goalreach_bringup.bags.zstandard import compress

__all__ = ['McapWriter']

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
