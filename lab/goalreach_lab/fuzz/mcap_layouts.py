"""MCAP files in every layout that the format allows; cut short or changed, and repaired."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
import itertools
from pathlib import Path
import shutil
import struct
from typing import Any, Final

from mcap.opcode import Opcode
from mcap.reader import McapReader, NonSeekingReader, make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, IndexType, Writer
import numpy as np

from goalreach_bags.reader import BagReader
from goalreach_bags.repair import repair_bag
from goalreach_bags.storage import BagError
from goalreach_bags.topic import message_definition
from goalreach_lab.fuzz.reader import Reader
from goalreach_lab.fuzz.valid_inputs import STRING, serialize_text

UNKNOWN: Final = struct.pack('<BQ', 0x80, 5) + b'mine!'
"""A record of a kind that only its writer knows."""

COUNT: Final = 20
"""Messages of each of the two topics."""

_PADDED: Final = struct.pack('<BQIII', Opcode.METADATA, 16, 0, 0, 0) + b'more'
"""Metadata without a name, with bytes after its fields, which a reader has to skip."""

_CHUNK_BYTES: Final = 1500
"""About six messages, so that a file has several chunks."""

_CONTENTS: Final = ('ordered', 'schemaless, out of order', 'everything', 'extras', 'empty')


_Count = Counter[tuple[int, int, bytes]]


@dataclass(frozen=True, kw_only=True)
class McapLayout:
    """One way to write an MCAP file.

    Attributes:
        content: What it holds: `extras` are attachments and metadata.
        profile: Profile in its header.
        options: Options of the writer of `mcap`.
    """

    content: str
    profile: str
    options: dict[str, Any]

    def encode(self) -> bytes:
        """Return the file."""
        stream = BytesIO()
        writer = Writer(stream, chunk_size=_CHUNK_BYTES, **self.options)
        writer.start(self.profile, library='somebody')
        if self.content in ('extras', 'everything'):
            writer.add_attachment(1, 2, 'notes.txt', 'text/plain', b'remember')
            writer.add_metadata('mine', {'a': 'b'})
        if self.content not in ('extras', 'empty'):
            self._add_messages(writer, stream)
        writer.finish()  # type: ignore[no-untyped-call]
        return stream.getvalue()

    def _add_messages(self, writer: Writer, stream: BytesIO) -> None:
        schema = writer.register_schema(STRING, 'ros2msg', message_definition(STRING).encode())
        other, encoding = (schema, 'cdr') if self.content == 'ordered' else (0, 'json')
        channels = {
            '/text': writer.register_channel('/text', 'cdr', schema),
            '/other': writer.register_channel('/other', encoding, other),
        }
        numbers = np.arange(COUNT)
        if self.content != 'ordered':
            np.random.default_rng(0).shuffle(numbers)
        for number in numbers.tolist():
            for name, channel in channels.items():
                data = serialize_text(f'{name} {number} ' + f'{number**9:x}' * 8)
                writer.add_message(channel, 1000 + number, data, 900 + number, number)
            if self.content == 'everything' and number in (3, 7):
                writer.flush()  # type: ignore[no-untyped-call]
                stream.write(UNKNOWN + _PADDED)


def mcap_layouts() -> list[McapLayout]:
    """Return all layouts: chunks, compression, indexes, summary, check sums and contents."""
    indexes = (IndexType.NONE, IndexType.MESSAGE, IndexType.CHUNK, IndexType.ALL)
    chunks = itertools.product((True,), CompressionType, indexes)
    storages = [(False, CompressionType.NONE, IndexType.NONE), *chunks]
    flags = (True, False)
    repeats = ((True, True), (True, False), (False, False))
    profiles = itertools.cycle(('', 'ros2', 'ros1'))
    return [
        McapLayout(
            content=content,
            profile=next(profiles),
            options={
                'use_chunking': chunked,
                'compression': compression,
                'index_types': index,
                'repeat_channels': channels,
                'repeat_schemas': schemas,
                'use_statistics': count,
                'use_summary_offsets': count,
                'enable_crcs': sums,
                # The writer of `mcap` does not see the records that are added by hand.
                'enable_data_crcs': sums and content != 'everything',
            },
        )
        for content, (chunked, compression, index), (channels, schemas), count, sums in (
            itertools.product(_CONTENTS, storages, repeats, flags, flags)
        )
        # Without messages there is nothing to compress.
        if content not in _CONTENTS[3:] or compression is CompressionType.NONE
    ]


def _spans(data: bytes) -> Iterator[tuple[int, int, list[Message]]]:
    """Yield begin, end and messages of each chunk and of each message outside of chunks."""
    offset = 8
    while data[offset] != Opcode.DATA_END:
        end = offset + 9 + int.from_bytes(data[offset + 1 : offset + 9], 'little')
        if data[offset] in (Opcode.CHUNK, Opcode.MESSAGE):
            stream = BytesIO(data[offset:end])
            record = next(StreamReader(stream, skip_magic=True, emit_chunks=True).records)
            records = breakup_chunk(record) if isinstance(record, Chunk) else [record]
            yield offset, end, [record for record in records if isinstance(record, Message)]
        offset = end


def _count(messages: Iterable[Message]) -> _Count:
    return Counter((message.log_time, message.sequence, message.data) for message in messages)


def layout_reader(folder: Path, layouts: Sequence[McapLayout]) -> Reader:
    """Return a reader that repairs copies of files, each cut or with one changed byte.

    Args:
        folder: Folder for the copies.
        layouts: Layouts of the files, of which each copy has a random one.
    """

    def attempt(rng: np.random.Generator) -> object:
        layout = layouts[int(rng.integers(len(layouts)))]
        whole, cut = layout.encode(), rng.random() < 0.5  # noqa: PLR2004
        place = int(rng.integers(len(whole)))
        changed = bytes([whole[place] ^ int(rng.integers(1, 256))]) + whole[place + 1 :]
        is_resumed = layout.options['use_chunking'] and not cut
        sound = _count(
            message
            for begin, end, messages in _spans(whole)
            if end <= place or (is_resumed and begin > place)
            for message in messages
        )
        path = folder / 'damaged' / 'a.mcap'
        return _check_repair(path, whole[:place] + (b'' if cut else changed), sound)

    return Reader(name='damaged MCAP files', attempt=attempt)


def _check_repair(path: Path, data: bytes, sound: _Count) -> object:
    """Repair a file; return the messages that it then holds.

    Raises:
        BagError: It cannot be repaired, and holds nothing.
        AssertionError: The original or a sound message is lost, or the result cannot be read.
    """
    shutil.rmtree(path.parent, ignore_errors=True)
    path.parent.mkdir()
    path.write_bytes(data)
    try:
        result = repair_bag(path.parent)
    except BagError as error:
        if sound or path.read_bytes() != data:
            raise AssertionError(f'{sound.total()} messages are not repaired: {error}') from None
        raise
    kept = path.with_name(f'{path.name}.damaged') if result.damage else path
    if kept.read_bytes() != data:
        raise AssertionError('the original is not kept')
    with path.open('rb') as stream:
        reader: McapReader = NonSeekingReader(stream, validate_crcs=True)
        if result.damage:  # else its index may need channels that its summary lacks
            reader = make_reader(stream, validate_crcs=True)
        found = _count(message for _, _, message in reader.iter_messages())
    if lost := (sound - found).total():
        raise AssertionError(f'{lost} of {sound.total()} messages are lost: {result}')
    with BagReader(path.parent) as bag:
        counts = {found.total(), result.messages, sum(1 for _ in bag.messages())}
    if len(counts) > 1:
        raise AssertionError(f'readers and repair find {counts}')
    return found
