"""Bags of recorders that died, brought in order."""

from contextlib import closing
import errno
import os
from pathlib import Path
import random
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import time

from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import ChunkIndex
import pytest

from goalreach_bags.reader import BagReader
from goalreach_bags.repair import repair_bag
from goalreach_bags.sqlite_file import SqliteScan, journals_of
from goalreach_bags.storage import BagError, FileSpan, storage_files
from small_bags import texts, write_bag

WRITER = """
import os
import sys
from small_bags import string_topic, text_message
from goalreach_bags.writer import BagWriter
from goalreach_bags.options import StorageOptions

options = StorageOptions(storage=sys.argv[2], zstd=sys.argv[3] == 'zstd', max_size=9.0)
writer = BagWriter(sys.argv[1], options)
writer.add_topic(string_topic())
flush = writer._flush

def flush_and_tell():
    flush()
    print(sum(span.message_count for span in writer._spans), flush=True)

writer._flush = flush_and_tell
noise = [text_message(os.urandom(20_000).hex()) for _ in range(50)]
for number in range(10**9):
    writer.write('/text', number + 1, noise[number % 50])
"""


def chunk_indexes(path: Path) -> list[ChunkIndex]:
    with path.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return summary.chunk_indexes


def end_of(chunk: ChunkIndex) -> int:
    return chunk.chunk_start_offset + chunk.chunk_length


@pytest.mark.parametrize('options', ['mcap -', 'mcap zstd', 'sqlite3 -', 'sqlite3 zstd'])
def test_killed_recorder_loses_nothing_that_was_finished(tmp_path: Path, options: str) -> None:
    rng = random.Random(7)  # noqa: S311 - moments to kill at
    for attempt in range(2):
        path = tmp_path / str(attempt)
        process = subprocess.Popen(
            [sys.executable, '-c', WRITER, str(path), *options.split()],
            stdout=subprocess.PIPE,
            text=True,
            env={'PYTHONPATH': ':'.join(sys.path)},
        )
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(rng.random() * 0.1)
        process.send_signal(signal.SIGKILL)
        told = process.communicate()[0].split()
        finished = int(told[-1]) if told else 0

        result = repair_bag(path)

        assert result.messages >= finished
        assert not result.was_sound
        with BagReader(path) as bag:
            found = [message.time_ns for message in bag.messages()]
        assert found == list(range(1, result.messages + 1))
        assert repair_bag(path).was_sound


@pytest.mark.parametrize('begin', [b'', b'\x89MCA'])
def test_a_next_file_that_was_only_begun_is_dropped(tmp_path: Path, begin: bytes) -> None:
    write_bag(tmp_path / 'bag', texts(10, 1000))
    (tmp_path / 'bag' / 'bag_1.mcap').write_bytes(begin)
    assert repair_bag(tmp_path / 'bag').messages == 10
    assert not (tmp_path / 'bag' / 'bag_1.mcap').exists()


def test_a_next_file_without_its_tables_is_dropped_and_a_stranger_is_not(tmp_path: Path) -> None:
    write_bag(tmp_path / 'bag', texts(10, 1000), storage='sqlite3')
    begun, stranger = tmp_path / 'bag' / 'bag_1.db3', tmp_path / 'bag' / 'bag_2.db3'
    with closing(sqlite3.connect(begun)) as base:
        base.execute('CREATE TABLE schema(schema_version INTEGER)')
    assert repair_bag(tmp_path / 'bag').messages == 10
    assert not begun.exists()
    with closing(sqlite3.connect(stranger)) as base:
        base.execute('CREATE TABLE mine(value INTEGER)')
    with pytest.raises(BagError, match='no SQLite file of a bag'):
        repair_bag(tmp_path / 'bag')
    assert stranger.exists()


def test_file_cut_anywhere_keeps_its_finished_chunks(tmp_path: Path) -> None:
    write_bag(tmp_path / 'whole', texts(40, 100_000))
    data = (tmp_path / 'whole' / 'whole_0.mcap').read_bytes()
    chunks = chunk_indexes(tmp_path / 'whole' / 'whole_0.mcap')
    rng = random.Random(3)  # noqa: S311 - places to cut at
    cuts = [rng.randrange(100, len(data)) for _ in range(50)]
    for number, cut in enumerate([*cuts, len(data) - 1, end_of(chunks[0])]):
        path = tmp_path / str(number)
        path.mkdir()
        (path / f'{number}_0.mcap').write_bytes(data[:cut])
        whole = [chunk for chunk in chunks if end_of(chunk) <= cut]

        result = repair_bag(path)

        assert result.messages == (whole[-1].message_end_time // 1_000_000 if whole else 0)
        assert (path / f'{number}_0.mcap.damaged').read_bytes() == data[:cut]
        with BagReader(path) as bag:
            assert len(list(bag.messages())) == result.messages
        with (path / f'{number}_0.mcap').open('rb') as stream:
            reader = make_reader(stream, validate_crcs=True)
            assert len(list(reader.iter_messages())) == result.messages
            summary = reader.get_summary()
            assert summary is not None
            assert all(index.message_index_offsets for index in summary.chunk_indexes)
        shutil.rmtree(path)


def test_indexes_that_were_never_written_are_made(tmp_path: Path) -> None:
    write_bag(tmp_path / 'bag', texts(30, 100_000))
    path = tmp_path / 'bag' / 'bag_0.mcap'
    data, position, bare = path.read_bytes(), 8, path.read_bytes()[:8]
    while position < len(data) - 8:
        opcode, length = struct.unpack_from('<BQ', data, position)
        end = position + 9 + length
        if opcode in (Opcode.HEADER, Opcode.CHUNK):
            bare += data[position:end]
        position = end
    path.write_bytes(bare)

    assert repair_bag(tmp_path / 'bag').messages == 30
    assert all(index.message_index_offsets for index in chunk_indexes(path))
    with path.open('rb') as stream:
        found = make_reader(stream, validate_crcs=True).iter_messages()
        assert [(m.log_time, m.data) for _, _, m in found] == [m[1:] for m in texts(30, 100_000)]


def test_missing_summary_alone_is_written_again(tmp_path: Path) -> None:
    write_bag(tmp_path / 'bag', texts(5), max_duration=0.003)
    before = (tmp_path / 'bag' / 'metadata.yaml').read_text()
    (tmp_path / 'bag' / 'metadata.yaml').unlink()

    assert 'repaired: 5 messages, 0.0 s; lost: nothing' in str(repair_bag(tmp_path / 'bag'))
    assert (tmp_path / 'bag' / 'metadata.yaml').read_text() == before


@pytest.mark.parametrize('number', [0, 2])
def test_damaged_chunk_alone_is_lost(tmp_path: Path, number: int) -> None:
    write_bag(tmp_path / 'bag', texts(40, 100_000))
    path = tmp_path / 'bag' / 'bag_0.mcap'
    data = bytearray(path.read_bytes())
    data[chunk_indexes(path)[number].chunk_start_offset + 1000] ^= 1
    path.write_bytes(bytes(data))

    result = repair_bag(tmp_path / 'bag')

    assert result.messages == 32
    assert 'bag_0.mcap: chunk ' in str(result)
    assert (tmp_path / 'bag' / 'bag_0.mcap.damaged').read_bytes() == bytes(data)
    assert repair_bag(tmp_path / 'bag').was_sound


@pytest.mark.parametrize(
    ('files', 'reason'),
    [
        ({}, 'holds no .mcap and no .db3 file'),
        ({'a.mcap': b''}, 'is no MCAP file'),
        ({'a.mcap': b'something else'}, 'is no MCAP file'),
        ({'a.db3': b'something else, longer than a header'}, 'is no SQLite file of a bag'),
        ({'a.mcap': b'', 'a.db3': b''}, 'holds both'),
    ],
)
def test_what_is_no_bag_is_refused(tmp_path: Path, files: dict[str, bytes], reason: str) -> None:
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)

    with pytest.raises(BagError, match=reason):
        repair_bag(tmp_path)


def test_what_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match='is not a bag'):
        repair_bag(tmp_path / 'nothing')


@pytest.mark.parametrize('offers', ['- rel]ability: reliable', "- depth: '7'", '[' * 1000])
def test_offers_that_are_damaged_take_no_message_away(tmp_path: Path, offers: str) -> None:
    write_bag(tmp_path / 'bag', texts(5), storage='sqlite3')
    with closing(sqlite3.connect(tmp_path / 'bag' / 'bag_0.db3')) as base, base:
        base.execute('UPDATE topics SET offered_qos_profiles = ?', (offers,))
    (tmp_path / 'bag' / 'metadata.yaml').unlink()

    assert repair_bag(tmp_path / 'bag').messages == 5
    with BagReader(tmp_path / 'bag') as bag:
        assert sum(1 for _ in bag.messages()) == 5
    assert repair_bag(tmp_path / 'bag').was_sound


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_disk_that_is_full_leaves_the_damaged_bag_as_it_was(
    tmp_path: Path, storage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_bag(tmp_path / 'bag', texts(10), storage=storage)
    (path,) = storage_files(tmp_path / 'bag')
    if storage == 'mcap':
        path.write_bytes(path.read_bytes()[:-9])
    else:
        path.with_name(f'{path.name}-journal').touch()
    before = {file.name: file.read_bytes() for file in path.parent.iterdir()}

    def fail(*_arguments: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr('goalreach_bags.mcap_repair.Writer.finish', fail)
    monkeypatch.setattr('goalreach_bags.sqlite_file._add_metadata', fail)
    with pytest.raises(BagError, match='cannot be repaired: No space left on device'):
        repair_bag(tmp_path / 'bag')

    assert {file.name: file.read_bytes() for file in path.parent.iterdir()} == before


def test_what_a_killed_recorder_left_in_a_write_ahead_log_is_kept(tmp_path: Path) -> None:
    """`ros2 bag record --storage-preset-profile resilient` writes such bags."""
    write_bag(tmp_path / 'bag', texts(1), storage='sqlite3')
    (file,) = storage_files(tmp_path / 'bag')
    (tmp_path / 'copy').mkdir()
    base = sqlite3.connect(file)
    base.execute('PRAGMA journal_mode=WAL')
    (data,) = base.execute('SELECT data FROM messages').fetchone()
    rows = [(number, data) for number in range(2, 51)]
    base.executemany('INSERT INTO messages VALUES(NULL, 1, ?, ?)', rows)
    base.commit()
    for each in (file, *journals_of(file)[1:]):
        shutil.copy(each, tmp_path / 'copy')
    base.close()

    assert repair_bag(tmp_path / 'copy').messages == 50
    with BagReader(tmp_path / 'copy') as bag:
        assert sum(1 for _ in bag.messages()) == 50
    (repaired,) = storage_files(tmp_path / 'copy')
    assert not any(journal.exists() for journal in journals_of(repaired))
    with closing(sqlite3.connect(repaired.with_name(f'{repaired.name}.damaged'))) as damaged:
        assert damaged.execute('SELECT COUNT(*) FROM messages').fetchone() == (50,)


def test_of_many_problems_three_are_shown() -> None:
    for problems, damage in (('abc', 'a; b; c'), ('abcde', 'a; b; c; 2 more'), ('', '')):
        scan = SqliteScan(
            path=Path('bag'), span=FileSpan(name='bag'), problems=dict.fromkeys(problems)
        )
        assert scan.damage == damage
