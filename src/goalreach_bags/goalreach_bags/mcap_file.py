"""MCAP files: written chunk by chunk, so that a finished chunk survives the process; and read."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack
import errno
from io import BytesIO
from pathlib import Path
import sys
from typing import Final

from mcap.reader import make_reader
from mcap.records import Statistics
from mcap.summary import Summary
from mcap.writer import CompressionType, Writer

from goalreach_bags.mcap_repair import BAG_METADATA, COPY_KEY, LIBRARY, channel_topic, scan_mcap
from goalreach_bags.storage import FileSpan, StoredMessage
from goalreach_bags.topic import BagTopic, offers_to_text

_PER_CHUNK_BYTES: Final = 1024
"""Upper estimate of the bytes that a chunk adds besides messages: 10 for each topic, and 200."""


class _Tail(BytesIO):
    """What the writer has made and the file does not hold yet; positions are those in the file."""

    begin = 0

    def tell(self) -> int:
        """Return the position in the file."""
        return self.begin + super().tell()


class McapWriter:
    """Writes one new MCAP file of a bag.

    What has been appended survives if the process is killed. Every method may raise OSError; the
    file then still ends after what was appended before.

    Attributes:
        closing_bytes: Upper estimate of what the file needs to be closed.
    """

    def __init__(self, path: Path, *, zstd: bool) -> None:
        self._stream = path.open('xb', buffering=0)
        self._tail = _Tail()
        kind = CompressionType.ZSTD if zstd else CompressionType.NONE
        self._writer = Writer(self._tail, chunk_size=sys.maxsize, compression=kind)
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._failed = False
        self.closing_bytes = 0
        self._writer.start('ros2', LIBRARY)
        self._append()

    @property
    def size(self) -> int:
        """Bytes so far."""
        return self._tail.begin

    def add_topic(self, topic: BagTopic) -> None:
        """Add schema and channel of a topic, with the metadata that rosbag2 keeps."""
        name, definition, offers = topic.type_name, topic.definition, offers_to_text(topic.offers)
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(
                name, topic.encoding, definition.encode()
            )
        metadata = {'offered_qos_profiles': offers, 'topic_type_hash': topic.type_hash}
        self._channels[topic.name] = self._writer.register_channel(
            topic.name, 'cdr', self._schemas[name], metadata
        )
        self.closing_bytes += len(definition.encode()) + len(offers) + _PER_CHUNK_BYTES

    def append(self, messages: Sequence[StoredMessage]) -> None:
        """Write messages as one chunk, with its indexes."""
        for topic, time_ns, publish_ns, data in messages:
            self._writer.add_message(self._channels[topic], time_ns, data, publish_ns)
        self._writer.flush()  # type: ignore[no-untyped-call]
        self.closing_bytes += _PER_CHUNK_BYTES
        self._append()

    def finish(self, metadata: str) -> None:
        """Write the bag's metadata and the summary, unless the file lacks a chunk."""
        if self._failed:
            raise OSError(errno.EIO, 'an earlier chunk was not written')
        self._writer.add_metadata(BAG_METADATA, {COPY_KEY: metadata})
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._append()
        self.close()

    def close(self) -> None:
        """Close the file as it is."""
        self._stream.close()

    def _append(self) -> None:
        """Write what the writer has made to the file, wholly or not at all."""
        tail, begin = self._tail, self._tail.begin
        rest = memoryview(tail.getvalue())
        try:
            while rest:
                rest = rest[self._stream.write(rest) :]
        except OSError:
            self._failed = True
            self._stream.truncate(begin)
            self._stream.seek(begin)
            raise
        tail.begin = tail.tell()
        tail.seek(0)
        tail.truncate()


def _is_complete(summary: Summary, total: Statistics) -> bool:
    """Return whether a summary describes all channels and counts all messages."""
    counts, schemas = total.channel_message_counts, {0, *summary.schemas}
    return (
        total.channel_count == len(summary.channels)
        and total.message_count == sum(counts.values())
        and counts.keys() <= summary.channels.keys()
        and all(channel.schema_id in schemas for channel in summary.channels.values())
    )


class McapReader:
    """Reads one MCAP file, until `opened` is closed.

    Attributes:
        span: Its messages by number and time.
    """

    def __init__(self, path: Path, opened: ExitStack) -> None:
        self._reader = make_reader(opened.enter_context(path.open('rb')), validate_crcs=True)
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

    def messages(
        self, topics: Collection[str], start_ns: int | None, stop_ns: int | None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, receive time and data by receive time, from a start to before a stop."""
        found = self._reader.iter_messages(topics, starting_at=start_ns, ending_before=stop_ns)
        for _, channel, message in found:
            yield channel.topic, message.log_time, message.data
