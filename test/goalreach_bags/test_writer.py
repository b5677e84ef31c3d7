"""What we write, read by others; and what happens where the disk does not do its part."""

import errno
import os
from pathlib import Path
import shutil
import sqlite3
from typing import Any

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import pytest
from rosbags.rosbag2 import Reader
import yaml

from goalreach_bags import writer
from goalreach_bags.mcap_file import McapWriter
from goalreach_bags.options import StorageOptions
from goalreach_bags.reader import BagReader
from goalreach_bags.repair import repair_bag
from goalreach_bags.storage import BagError, BagStoppedError
from goalreach_bags.writer import BagWriter
from small_bags import STORE, STRING, string_topic, text_message, texts, write_bag

BIG = 100_000


@pytest.mark.parametrize('zstd', [False, True])
def test_mcap_is_read_by_mcaps_own_reader(tmp_path: Path, *, zstd: bool) -> None:
    messages = texts(30, BIG)
    write_bag(tmp_path / 'bag', messages, zstd=zstd)

    path = tmp_path / 'bag' / 'bag_0.mcap'
    with path.open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        found = [(m.log_time, m.data) for _, _, m in reader.iter_messages()]
        kept = list(reader.iter_metadata())
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == 30
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 3
    assert found == [(time_ns, data) for _, time_ns, data in messages]
    channel = summary.channels[1]
    assert channel.metadata['topic_type_hash'] == STORE.hash_rihs01(STRING)
    assert yaml.safe_load(channel.metadata['offered_qos_profiles'])[0]['depth'] == 0
    assert yaml.safe_load(kept[0].metadata['serialized_metadata'])['message_count'] == 30
    with path.open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        decoded = [message.data for _, _, _, message in reader.iter_decoded_messages()]
    assert decoded == [f'{k:06d}' + 'x' * BIG for k in range(30)]


@pytest.mark.parametrize('zstd', [False, True])
@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_bag_is_read_by_rosbags(tmp_path: Path, storage: str, *, zstd: bool) -> None:
    messages = texts(30, BIG)
    write_bag(tmp_path / 'bag', messages, storage=storage, zstd=zstd, max_size=1.0)

    with Reader(tmp_path / 'bag') as reader:
        found = [(c.topic, t, bytes(data)) for c, t, data in reader.messages()]
        connection = reader.connections[0]
        assert reader.ros_distro == 'jazzy'
    assert found == messages
    assert connection.digest == STORE.hash_rihs01(STRING)
    assert connection.msgdef.data.startswith('# This was originally provided')


def test_sqlite_has_the_tables_of_jazzy(tmp_path: Path) -> None:
    write_bag(tmp_path / 'bag', texts(3), storage='sqlite3')

    base = sqlite3.connect(tmp_path / 'bag' / 'bag_0.db3')
    assert base.execute('SELECT * FROM schema').fetchall() == [(4, 'jazzy')]
    assert base.execute('SELECT metadata_version FROM metadata').fetchall() == [(9,)]
    assert base.execute('SELECT name, type, serialization_format FROM topics').fetchall() == [
        ('/text', STRING, 'cdr')
    ]
    assert base.execute('SELECT timestamp FROM messages').fetchall() == [
        (1_000_000,),
        (2_000_000,),
        (3_000_000,),
    ]
    base.close()
    assert sorted(path.name for path in (tmp_path / 'bag').iterdir()) == [
        'bag_0.db3',
        'metadata.yaml',
    ]


def test_summary_is_that_of_jazzy(tmp_path: Path) -> None:
    write_bag(tmp_path / 'bag', texts(3), custom={'note': 'x'}, max_duration=0.002)

    text = (tmp_path / 'bag' / 'metadata.yaml').read_text()
    information = yaml.safe_load(text)['rosbag2_bagfile_information']
    assert information['version'] == 9
    assert information['storage_identifier'] == 'mcap'
    assert information['duration'] == {'nanoseconds': 2_000_000}
    assert information['starting_time'] == {'nanoseconds_since_epoch': 1_000_000}
    assert information['relative_file_paths'] == ['bag_0.mcap', 'bag_1.mcap']
    assert [file['message_count'] for file in information['files']] == [2, 1]
    assert information['custom_data'] == {'note': 'x'}
    (topic,) = information['topics_with_message_count']
    assert topic['message_count'] == 3
    offer = topic['topic_metadata']['offered_qos_profiles'][0]
    assert (offer['history'], offer['reliability']) == ('unknown', 'reliable')
    assert offer['deadline'] == {'sec': 9223372036, 'nsec': 854775807}


def test_splits_hold_everything_once(tmp_path: Path) -> None:
    metadata = write_bag(tmp_path / 'bag', texts(100, 5000), max_size=0.1)

    assert [span.message_count for span in metadata.files] == [20, 20, 20, 20, 20]
    with BagReader(tmp_path / 'bag') as bag:
        assert [m.time_ns for m in bag.messages()] == [m[1] for m in texts(100, 5000)]


def test_a_bag_that_is_deleted_while_it_is_split_stops_the_recording(tmp_path: Path) -> None:
    path = tmp_path / 'bag'
    bag = BagWriter(path, StorageOptions(max_size=0.01))
    bag.add_topic(string_topic())
    for message in texts(10, 5000):
        bag.write(*message)
    size = bag.size
    assert size > 9 * 5000
    shutil.rmtree(path)
    assert bag.size == size
    with pytest.raises(BagStoppedError, match='recording stopped'):
        bag.close()


def test_same_messages_make_the_same_file(tmp_path: Path) -> None:
    for name in ('one', 'two'):
        write_bag(tmp_path / name / 'bag', texts(50, 1000))

    one, two = ((tmp_path / name / 'bag' / 'bag_0.mcap').read_bytes() for name in ('one', 'two'))
    assert one == two


def test_existing_directory_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match='exists already: a bag is never overwritten'):
        BagWriter(tmp_path, StorageOptions())


def test_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')

    with pytest.raises(BagError, match='cannot be made: Not a directory'):
        BagWriter(tmp_path / 'file' / 'bag', StorageOptions())


def test_what_is_a_second_old_is_flushed(tmp_path: Path) -> None:
    now_s = 0.0
    writer = BagWriter(tmp_path / 'bag', StorageOptions(), now=lambda: now_s)
    writer.add_topic(string_topic())
    path = tmp_path / 'bag' / 'bag_0.mcap'
    writer.write('/text', 1, text_message('a'))
    writer.flush_if_due()
    before = path.stat().st_size
    assert writer.size == before + len(text_message('a'))
    now_s = 1.0
    writer.flush_if_due()

    assert writer.size == path.stat().st_size > before + 100
    size = writer.size
    assert writer.close().total.message_count == 1
    assert writer.size == path.stat().st_size > size


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_full_disk_closes_a_bag_that_is_whole(
    tmp_path: Path, storage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    written, data_bytes = 0, 8 * len(texts(1, BIG)[0][2])  # 768 KiB are exceeded by the eighth

    def require_free_space(path: Path, needed: int) -> None:
        nonlocal written
        written += 1
        estimate = needed - 2 * data_bytes
        assert estimate == 0 if storage == 'sqlite3' else 1024 <= estimate < 8192
        if written == 3:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path), needed)

    monkeypatch.setattr(writer, 'require_free_space', require_free_space)

    with pytest.raises(BagStoppedError, match='recording stopped, the bag so far is complete'):
        write_bag(tmp_path / 'bag', texts(100, BIG), storage=storage)

    with BagReader(tmp_path / 'bag') as bag:
        found = [message.time_ns for message in bag.messages()]
        assert found == [1_000_000 * (k + 1) for k in range(len(found))]
        assert bag.counts == {'/text': len(found)}
        assert 10 < len(found) < 40


class FullStream:
    """A file on a disk that is full for a moment."""

    def __init__(self, stream: Any) -> None:  # noqa: ANN401
        self._stream = stream

    def write(self, _data: memoryview) -> int:
        raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self._stream, name)


def test_write_that_fails_half_way_leaves_what_repair_makes_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Cramped:
        """A file on a disk with room for a megabyte and a half."""

        def __init__(self, stream: Any) -> None:  # noqa: ANN401
            self._stream = stream

        def write(self, data: memoryview) -> int:
            room = 1_500_000 - self._stream.tell()
            if room <= 0:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return int(self._stream.write(data[:room]))

        def __getattr__(self, name: str) -> Any:  # noqa: ANN401
            return getattr(self._stream, name)

    before = McapWriter.__init__

    def cramp(self: McapWriter, path: Path, *, zstd: bool) -> None:
        before(self, path, zstd=zstd)
        self._stream = Cramped(self._stream)  # type: ignore[assignment]

    monkeypatch.setattr(McapWriter, '__init__', cramp)
    with pytest.raises(BagStoppedError, match='the bag so far needs record --repair'):
        write_bag(tmp_path / 'bag', texts(100, BIG))
    repair_bag(tmp_path / 'bag')

    with BagReader(tmp_path / 'bag') as bag:
        assert len(list(bag.messages())) == bag.counts['/text'] == 8


def test_a_file_that_lacks_a_chunk_is_not_called_complete(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    append, calls = McapWriter._append, 0

    def fail_once(self: McapWriter) -> None:
        nonlocal calls
        calls += 1
        stream = self._stream
        if calls == 3:
            self._stream = FullStream(stream)  # type: ignore[assignment]
        try:
            append(self)
        finally:
            self._stream = stream

    monkeypatch.setattr(McapWriter, '_append', fail_once)
    with pytest.raises(BagStoppedError, match='the bag so far needs record --repair'):
        write_bag(tmp_path / 'bag', texts(100, BIG))
    repair_bag(tmp_path / 'bag')

    with BagReader(tmp_path / 'bag') as bag:
        assert 0 < len(list(bag.messages())) == bag.counts['/text'] < 100
