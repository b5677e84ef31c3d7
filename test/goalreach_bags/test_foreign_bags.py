"""Bags of other writers: read whole, and never harmed by repair."""

from contextlib import closing
from pathlib import Path
import sqlite3

from mcap.reader import make_reader
from mcap.writer import CompressionType
import pytest
import yaml

from goalreach_bags.reader import BagReader
from goalreach_bags.repair import repair_bag
from goalreach_bags.storage import BagError
from small_bags import (
    DEFAULT_OFFER,
    FOREIGN_COUNT,
    QOS_8,
    STRING,
    UNKNOWN_RECORD,
    text_message,
    texts,
    write_bag,
    write_foreign,
)


def counted(path: Path) -> dict[str, int]:
    with BagReader(path) as bag:
        for name, count in bag.counts.items():
            assert len(list(bag.messages([name]))) == count
        return bag.counts


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
        base.execute(f'INSERT INTO topics VALUES({marks})', [2, *values[1:]])
        for number in range(5):  # two publishers may have a row of the same name each
            row = (1 + number % 2, number + 1, text_message('a'))
            base.execute('INSERT INTO messages VALUES(NULL, ?, ?, ?)', row)
    before = path.read_bytes()

    result = repair_bag(tmp_path / 'bag')

    assert (result.messages, result.damage) == (5, {})
    assert path.read_bytes() == before
    with BagReader(tmp_path / 'bag') as bag:
        assert [message.time_ns for message in bag.messages()] == [1, 2, 3, 4, 5]
        assert bag.topics['/text'].offers == ((DEFAULT_OFFER,) if offers else ())
