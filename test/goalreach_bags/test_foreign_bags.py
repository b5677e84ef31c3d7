"""Bags of other writers: read whole, and never harmed by repair."""

from collections.abc import Iterator
from contextlib import closing, suppress
from io import BytesIO
import itertools
from pathlib import Path
import random
import sqlite3
import struct
from typing import Any

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType
import pytest
import yaml
from zstandard import ZstdError

from goalreach_bags.reader import BagReader
from goalreach_bags.repair import repair_bag
from goalreach_bags.storage import BagError
from goalreach_bags.topic import DEFAULT_OFFER
from small_bags import (
    FOREIGN_COUNT,
    QOS_8,
    STRING,
    UNKNOWN_RECORD,
    text_message,
    texts,
    write_bag,
    write_foreign,
)


def combinations() -> Iterator[dict[str, Any]]:
    compressions = (CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD)
    indexes = (IndexType.ALL, IndexType.NONE, IndexType.CHUNK)
    flags = (True, False)
    for compression, index, repeat, total in itertools.product(
        compressions, indexes, flags, flags
    ):
        yield {
            'compression': compression,
            'index_types': index,
            'repeat_channels': repeat,
            'repeat_schemas': repeat,
            'use_statistics': total,
            'use_summary_offsets': total,
            'enable_crcs': total,
        }
    yield {'use_chunking': False}
    yield {'use_chunking': False, 'use_statistics': False, 'repeat_channels': False}


def counted(path: Path) -> dict[str, int]:
    with BagReader(path) as bag:
        for name, count in bag.counts.items():
            assert len(list(bag.messages([name]))) == count
        return bag.counts


def streamed(data: bytes) -> int:
    """Return how many messages mcap's own reader finds before the first damage."""
    found = 0
    with suppress(McapError, ValueError, struct.error, RuntimeError, OSError, ZstdError):
        for record in StreamReader(BytesIO(data), validate_crcs=True).records:
            found += isinstance(record, Message)
    return found


@pytest.mark.parametrize('options', combinations(), ids=repr)
def test_healthy_file_is_left_alone_and_read_whole(
    tmp_path: Path, options: dict[str, Any]
) -> None:
    path = tmp_path / 'bag' / 'a.mcap'
    write_foreign(path, **options)
    before = path.read_bytes()

    result = repair_bag(tmp_path / 'bag')

    assert (result.messages, result.damage) == (2 * FOREIGN_COUNT, {})
    assert path.read_bytes() == before
    assert counted(tmp_path / 'bag') == {'/text': FOREIGN_COUNT, '/json': FOREIGN_COUNT}
    assert repair_bag(tmp_path / 'bag').was_sound


@pytest.mark.parametrize('options', [*combinations()][::5], ids=repr)
def test_damaged_file_keeps_what_mcap_can_read(tmp_path: Path, options: dict[str, Any]) -> None:
    write_foreign(tmp_path / 'whole.mcap', **options)
    data = (tmp_path / 'whole.mcap').read_bytes()
    rng = random.Random(11)  # noqa: S311 - places to damage
    for number in range(10):
        damaged = bytearray(data[: rng.randrange(200, len(data))] if number % 2 else data)
        if not number % 2:
            damaged[rng.randrange(200, len(data))] ^= 1 << rng.randrange(8)
        bag = tmp_path / str(number)
        bag.mkdir()
        (bag / 'a.mcap').write_bytes(damaged)
        try:
            result = repair_bag(bag)
        except BagError:
            kept = [file for file in bag.glob('a.mcap*') if file.read_bytes() == damaged]
            assert kept, 'the damaged file is still there'
            continue
        assert result.messages >= streamed(bytes(damaged))
        name = 'a.mcap.damaged' if result.damage else 'a.mcap'
        assert (bag / name).read_bytes() == damaged


def test_records_that_are_not_understood_are_carried_over(tmp_path: Path) -> None:
    path = tmp_path / 'bag' / 'a.mcap'
    write_foreign(path)
    end = path.read_bytes().index(UNKNOWN_RECORD) + len(UNKNOWN_RECORD)
    path.write_bytes(path.read_bytes()[:end])

    result = repair_bag(tmp_path / 'bag', replace_files=True)

    assert 'a.mcap: no footer: it was not closed by its recorder' in str(result)
    assert sorted(file.name for file in path.parent.iterdir()) == ['a.mcap', 'metadata.yaml']
    assert counted(tmp_path / 'bag') == {'/text': FOREIGN_COUNT, '/json': FOREIGN_COUNT}
    assert UNKNOWN_RECORD in path.read_bytes()
    with path.open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert [a.data for a in reader.iter_attachments()] == [b'remember']
        assert [m.name for m in reader.iter_metadata()] == ['mine', 'rosbag2']
        assert reader.get_header().library == 'somebody'
    information = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text())
    bag = information['rosbag2_bagfile_information']
    assert bag['ros_distro'] == '', 'that of another writer is not known'
    offers = bag['topics_with_message_count'][0]['topic_metadata']['offered_qos_profiles']
    assert offers[0]['history'] == 'unknown', 'numbers of version 8 are words in version 9'


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_texts_of_the_recording_survive_a_lost_metadata_file(tmp_path: Path, storage: str) -> None:
    write_bag(tmp_path / 'bag', texts(5), storage=storage, custom={'note': 'kept'})
    (tmp_path / 'bag' / 'metadata.yaml').unlink()

    repair_bag(tmp_path / 'bag')

    with BagReader(tmp_path / 'bag') as bag:
        assert bag.metadata.custom == {'note': 'kept'}
        assert bag.metadata.distro == 'jazzy'


def test_chunk_with_an_impossible_length_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / 'bag' / 'a.mcap'
    write_foreign(path, compression=CompressionType.NONE)
    with path.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    data = bytearray(path.read_bytes())
    start = summary.chunk_indexes[1].chunk_start_offset + 9 + 32
    data[start : start + 8] = 8 * b'\xff'
    path.write_bytes(data)

    result = repair_bag(tmp_path / 'bag')

    assert 0 < 2 * FOREIGN_COUNT - result.messages < FOREIGN_COUNT
    assert sum(counted(tmp_path / 'bag').values()) == result.messages


def test_earlier_repair_is_not_overwritten(tmp_path: Path) -> None:
    write_bag(tmp_path / 'bag', texts(5))
    path = tmp_path / 'bag' / 'bag_0.mcap'
    path.write_bytes(path.read_bytes()[:-20])
    (tmp_path / 'bag' / 'bag_0.mcap.damaged').write_text('precious')

    with pytest.raises(BagError, match=r'bag_0\.mcap\.damaged of an earlier repair'):
        repair_bag(tmp_path / 'bag')
    assert (tmp_path / 'bag' / 'bag_0.mcap.damaged').read_text() == 'precious'


@pytest.mark.parametrize('offers', [True, False])
def test_sqlite_of_older_versions_is_read_and_repaired(tmp_path: Path, *, offers: bool) -> None:
    path = tmp_path / 'bag' / 'bag_0.db3'
    path.parent.mkdir()
    columns = 'id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT'
    columns += ', offered_qos_profiles TEXT' if offers else ''
    with closing(sqlite3.connect(path)) as base, base:
        base.execute(f'CREATE TABLE topics({columns})')
        base.execute(
            'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, '
            'timestamp INTEGER, data BLOB)'
        )
        values = [1, '/text', STRING, 'cdr', QOS_8][: 5 if offers else 4]
        marks = ', '.join('?' * len(values))
        base.execute(f'INSERT INTO topics VALUES({marks})', values)
        for number in range(5):
            row = (number + 1, text_message('a'))
            base.execute('INSERT INTO messages VALUES(NULL, 1, ?, ?)', row)
    before = path.read_bytes()

    result = repair_bag(tmp_path / 'bag')

    assert (result.messages, result.damage) == (5, {})
    assert path.read_bytes() == before
    with BagReader(tmp_path / 'bag') as bag:
        assert [message.time_ns for message in bag.messages()] == [1, 2, 3, 4, 5]
        assert bag.topics['/text'].offers == ((DEFAULT_OFFER,) if offers else ())
