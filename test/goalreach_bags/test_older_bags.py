"""Bags as older and other recorders leave them: every message is read, and repair harms none."""

from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
import sqlite3
from typing import Any

from mcap.writer import Writer
import pytest
from rosbags.rosbag2 import Reader
import yaml
import zstandard

from goalreach_bags.reader import BagReader
from goalreach_bags.repair import inspect_bag, repair_bag
from goalreach_bags.report import show_bag
from goalreach_bags.storage import BagError
from goalreach_bags.topic import message_definition
from small_bags import STRING, string_topic, text_message, texts, write_bag

COUNT = 5
BEST_EFFORT = '- history: 3\n  depth: 0\n  reliability: 2\n  durability: 2\n' + ''.join(
    f'  {name}: {{sec: 9223372036, nsec: 854775807}}\n'
    for name in ('deadline', 'lifespan', 'liveliness_lease_duration')
)
BEST_EFFORT += '  liveliness: 1\n  avoid_ros_namespace_conventions: false\n'
TABLES = {
    1: 'messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)',
    3: 'metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER, metadata TEXT)',
    4: 'message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, '
    'encoded_message_definition TEXT, type_description_hash TEXT)',
}
COLUMNS = {2: 'offered_qos_profiles', 4: 'type_description_hash'}
"""Tables and columns of a topic that each version of the schema of SQLite files added."""


def write_sqlite(path: Path, version: int, *, zstd: bool = False) -> bytes:
    """Write a file of a version of the schema; return its bytes."""
    path.parent.mkdir()
    added = {name: BEST_EFFORT if number == 2 else '' for number, name in COLUMNS.items()
             if number <= version}  # fmt: skip
    row = {'id': 1, 'name': '/text', 'type': STRING, 'serialization_format': 'cdr', **added}
    with closing(sqlite3.connect(path)) as base, base:
        for number, table in TABLES.items():
            if number <= version:
                base.execute(f'CREATE TABLE {table}')
        if version >= 3:
            base.execute('CREATE TABLE schema(schema_version INTEGER, ros_distro TEXT)')
            base.execute('INSERT INTO schema VALUES(?, ?)', (version, 'humble'))
            base.execute('INSERT INTO metadata VALUES(NULL, 5, ?)', ('{}',))
        base.execute(f'CREATE TABLE topics({", ".join(row)})')
        marks = ', '.join('?' * len(row))
        base.execute(f'INSERT INTO topics VALUES({marks})', tuple(row.values()))
        for number in range(COUNT):
            data = text_message('a')
            stored = zstandard.compress(data) if zstd else data
            base.execute('INSERT INTO messages VALUES(NULL, 1, ?, ?)', (number + 1, stored))
    return path.read_bytes()


def write_metadata(bag: Path, **changes: Any) -> None:  # noqa: ANN401 - as in YAML
    """Write the metadata of a bag of Humble, with an empty quality of service, as it may be."""
    topic = {
        'name': '/text',
        'type': STRING,
        'serialization_format': 'cdr',
        'offered_qos_profiles': '',
    }
    document = {
        'version': 5,
        'storage_identifier': 'sqlite3',
        'duration': {'nanoseconds': COUNT - 1},
        'starting_time': {'nanoseconds_since_epoch': 1},
        'message_count': COUNT,
        'topics_with_message_count': [{'topic_metadata': topic, 'message_count': COUNT}],
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': ['bag_0.db3'],
        'files': [],
        **changes,
    }
    text = yaml.safe_dump({'rosbag2_bagfile_information': document}, sort_keys=False)
    (bag / 'metadata.yaml').write_text(text)


def read_times(bag: Path) -> list[int]:
    with BagReader(bag) as reader:
        assert reader.counts == {'/text': COUNT}
        assert {message.data for message in reader.messages()} == {text_message('a')}
        return [message.time_ns for message in reader.messages()]


@pytest.mark.parametrize('version', range(1, 5))
@pytest.mark.parametrize('has_metadata', [True, False])
def test_sqlite_of_every_version_is_read_whole_and_left_alone(
    tmp_path: Path, version: int, *, has_metadata: bool
) -> None:
    bag = tmp_path / 'bag'
    before = write_sqlite(bag / 'bag_0.db3', version)
    if has_metadata:
        write_metadata(bag)
        assert inspect_bag(bag) == ((), '')

    result = repair_bag(bag)

    assert (result.messages, result.damage, result.was_sound) == (COUNT, {}, has_metadata)
    assert (bag / 'bag_0.db3').read_bytes() == before
    assert read_times(bag) == [1, 2, 3, 4, 5]
    with BagReader(bag) as reader:
        offers = reader.topics['/text'].offers
        reliabilities = [offer['reliability'] for offer in offers]
        assert reliabilities == (['best_effort'] if version >= 2 else [])
        distro = 'humble' if version >= 3 and not has_metadata else ''
        assert reader.metadata.distro == distro, 'that of an older recorder is not known'


def test_repaired_metadata_of_an_older_bag_is_read_by_rosbags(tmp_path: Path) -> None:
    write_sqlite(tmp_path / 'bag' / 'bag_0.db3', 4)
    repair_bag(tmp_path / 'bag')

    with Reader(tmp_path / 'bag') as reader:
        assert [time_ns for _, time_ns, _ in reader.messages()] == [1, 2, 3, 4, 5]


@pytest.mark.parametrize(
    ('changes', 'problem'),
    [
        ({}, ''),
        ({'version': 1, 'relative_file_paths': ['bag/bag_0.db3']}, ''),
        ({'version': 9, 'relative_file_paths': ['/elsewhere/bag_0.db3']}, ''),
        ({'version': 6, 'custom_data': ['a', 'b']}, ''),
        ({'version': 6, 'custom_data': None}, ''),
        ({'version': 6, 'custom_data': {1: float('inf')}}, ''),
        ({'duration': {'nanoseconds': 1}}, 'its times are not those of the messages'),
        ({'topics_with_message_count': []}, 'counts 0 messages of /text, the files hold 5'),
    ],
)
def test_metadata_of_other_recorders_is_borne(
    tmp_path: Path,
    changes: Mapping[str, Any],
    problem: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    bag = tmp_path / 'bag'
    before = write_sqlite(bag / 'bag_0.db3', 2)
    write_metadata(bag, **changes)

    assert read_times(bag) == [1, 2, 3, 4, 5]
    with BagReader(bag) as reader:
        show_bag(reader, check=True)
    expected = f'metadata.yaml: {problem}' if problem else 'sound'
    assert f'state:      {expected}\n' in capsys.readouterr().out
    assert repair_bag(bag).was_sound == (not problem)
    assert inspect_bag(bag) == ((), '')
    assert (bag / 'bag_0.db3').read_bytes() == before


@pytest.mark.parametrize('suffix', ['.mcap', '.db3'])
def test_files_that_are_compressed_as_a_whole_are_read(tmp_path: Path, suffix: str) -> None:
    bag, storage = tmp_path / 'bag', 'mcap' if suffix == '.mcap' else 'sqlite3'
    messages = [('/text', number + 1, text_message('a')) for number in range(COUNT)]
    write_bag(bag, messages, storage=storage)
    path, packed = bag / f'bag_0{suffix}', bag / f'bag_0{suffix}.zstd'
    packed.write_bytes(zstandard.compress(path.read_bytes()))
    path.unlink()
    write_metadata(
        bag,
        storage_identifier=storage,
        compression_format='zstd',
        compression_mode='FILE',
        relative_file_paths=[packed.name],
    )

    assert read_times(bag) == [1, 2, 3, 4, 5]
    assert inspect_bag(bag)[0] == ()


@pytest.mark.parametrize('has_metadata', [True, False])
@pytest.mark.parametrize('suffix', ['.mcap', '.db3'])
def test_messages_that_are_compressed_one_by_one_are_read_and_stay_so(
    tmp_path: Path, suffix: str, *, has_metadata: bool
) -> None:
    path = tmp_path / 'bag' / f'bag_0{suffix}'
    if suffix == '.db3':
        write_sqlite(path, 4, zstd=True)
    else:
        path.parent.mkdir()
        with path.open('wb') as stream:
            writer = Writer(stream)
            writer.start('ros2', library='somebody')
            definition = message_definition(STRING).encode()
            schema = writer.register_schema(STRING, 'ros2msg', definition)
            channel = writer.register_channel('/text', 'cdr', schema)
            for number in range(COUNT):
                data = zstandard.compress(text_message('a'))
                writer.add_message(channel, number + 1, data, number + 1)
            writer.finish()  # type: ignore[no-untyped-call]
    before = path.read_bytes()
    if has_metadata:
        write_metadata(
            path.parent,
            storage_identifier='mcap' if suffix == '.mcap' else 'sqlite3',
            compression_format='zstd',
            compression_mode='message',
            relative_file_paths=[path.name],
        )

    assert repair_bag(path.parent).was_sound == has_metadata

    assert path.read_bytes() == before
    assert read_times(path.parent) == [1, 2, 3, 4, 5]


@pytest.mark.parametrize(
    'changes',
    [
        {'duration': {'nanoseconds': float('inf')}},
        {'message_count': [], 'topics_with_message_count': 3},
        {'relative_file_paths': [3000 * 'a']},
    ],
)
def test_metadata_with_impossible_values_is_refused_and_repaired(
    tmp_path: Path, changes: Mapping[str, Any]
) -> None:
    write_sqlite(tmp_path / 'bag' / 'bag_0.db3', 4)
    write_metadata(tmp_path / 'bag', **changes)

    with pytest.raises(BagError, match=r'metadata\.yaml: is not the metadata of a bag$'):
        BagReader(tmp_path / 'bag')
    assert not repair_bag(tmp_path / 'bag').was_sound
    assert read_times(tmp_path / 'bag') == [1, 2, 3, 4, 5]


def test_topic_without_messages_whose_type_is_not_installed_costs_nothing(tmp_path: Path) -> None:
    event = string_topic('/events/write_split', type_name='rosbag2_interfaces/msg/WriteSplitEvent')
    write_bag(tmp_path / 'bag', texts(COUNT), topics=[string_topic(), event])

    with BagReader(tmp_path / 'bag') as bag:
        assert len(list(bag.messages())) == COUNT
        assert bag.counts == {'/text': COUNT, '/events/write_split': 0}
    assert inspect_bag(tmp_path / 'bag') == ((), '')
