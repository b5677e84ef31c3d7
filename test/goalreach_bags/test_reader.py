"""Every mistake about a bag is one line that says what to do."""

from pathlib import Path

import pytest

from goalreach_bags.reader import BagReader
from goalreach_bags.repair import inspect_bag, repair_bag
from goalreach_bags.storage import BagError
from small_bags import DEFAULT_OFFER, texts, write_bag

COMMON = """\
  storage_identifier: mcap
  duration: {nanoseconds: 19000000}
  starting_time: {nanoseconds_since_epoch: 1000000}
  message_count: 20
  topics_with_message_count:
    - message_count: 20
      topic_metadata:
        name: /text
        type: std_msgs/msg/String
        serialization_format: cdr
"""
QOS = """\
        offered_qos_profiles: "- history: 3\\n  depth: 0\\n  reliability: 1\\n  durability: 2"
"""
ADDED = {
    1: '  relative_file_paths: [bag/bag_0.mcap]\n',
    3: "  compression_format: ''\n  compression_mode: ''\n",
    4: '  relative_file_paths: [bag_0.mcap]\n',
    5: '  files: [{path: bag_0.mcap, message_count: 20}]\n',
    6: '  custom_data: {a: b}\n',
    8: '  ros_distro: rolling\n',
}
"""What the versions of metadata.yaml added, or changed under the same name."""


def document_of(version: int) -> str:
    added: dict[str, str] = {}
    for number, text in ADDED.items():
        if number <= version:
            added[text.split(':')[0]] = text
    return COMMON + (QOS if version >= 4 else '') + ''.join(added.values())


VERSIONS = {version: document_of(version) for version in range(1, 10)}


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    write_bag(tmp_path / 'bag', texts(20, 100_000))
    return tmp_path / 'bag'


def read(path: Path) -> int:
    with BagReader(path) as bag:
        return len(list(bag.messages()))


def refusal(path: Path) -> str:
    with pytest.raises(BagError) as caught:
        read(path)
    text = str(caught.value)
    assert len(text.splitlines()) == 1
    return text


def change(bag: Path, before: str, after: str) -> None:
    path = bag / 'metadata.yaml'
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after, 1))


def test_whole_bag_is_read(bag: Path) -> None:
    assert read(bag) == 20


def test_older_version_is_read(bag: Path) -> None:
    change(bag, 'version: 9', 'version: 5')

    assert read(bag) == 20


@pytest.mark.parametrize(('version', 'document'), VERSIONS.items())
def test_every_version_of_the_metadata_is_read(bag: Path, version: int, document: str) -> None:
    text = f'rosbag2_bagfile_information:\n  version: {version}\n{document}'
    (bag / 'metadata.yaml').write_text(text)

    with BagReader(bag) as reader:
        assert reader.metadata.version == version
        assert reader.counts == {'/text': 20}
        assert reader.metadata.distro == ('rolling' if version >= 8 else '')
        assert reader.metadata.custom == ({'a': 'b'} if version >= 6 else {})
    assert inspect_bag(bag)[0] == ()


def test_newer_version_is_read_as_far_as_it_is_known(
    bag: Path, caplog: pytest.LogCaptureFixture
) -> None:
    change(bag, 'version: 9', 'version: 10')
    change(bag, 'relative_file_paths:', 'renamed_file_paths:')

    assert read(bag) == 20
    (warning,) = caplog.messages
    assert warning.endswith('is of version 10: versions to 9 are known; what else it says is not '
                            'read')  # fmt: skip
    assert inspect_bag(bag) == ((), '')
    (bag / 'bag_0.mcap').write_bytes((bag / 'bag_0.mcap').read_bytes()[:-20])
    assert inspect_bag(bag)[1] == '', 'a repair would lose what it does not know'
    with pytest.raises(BagError, match='newer than is known here: it cannot be written again'):
        repair_bag(bag)


def test_unknown_storage_is_refused(bag: Path) -> None:
    change(bag, 'storage_identifier: mcap', 'storage_identifier: tape')

    assert refusal(bag).endswith("storage plug-in 'tape' is not known: mcap and sqlite3 are")


def test_unknown_compression_is_refused(bag: Path) -> None:
    change(bag, "compression_format: ''\n  compression_mode: ''",
           'compression_format: lz4\n  compression_mode: MESSAGE')  # fmt: skip

    assert refusal(bag).endswith("compression 'lz4' is not known: zstd is")


@pytest.mark.parametrize('kept', [0.0, 0.3, 0.9])
def test_truncated_file_is_refused(bag: Path, kept: float) -> None:
    path = bag / 'bag_0.mcap'
    path.write_bytes(path.read_bytes()[: int(kept * path.stat().st_size)])

    text = refusal(bag)
    assert ('no footer' if kept else 'is no MCAP file') in text
    assert ('record --repair' in text) == bool(kept)


def test_changed_bytes_are_found(bag: Path) -> None:
    path = bag / 'bag_0.mcap'
    data = bytearray(path.read_bytes())
    data[300_000] ^= 1
    path.write_bytes(bytes(data))

    assert 'crc validation failed' in refusal(bag)


def test_missing_file_is_refused(bag: Path) -> None:
    (bag / 'bag_0.mcap').unlink()

    assert refusal(bag).endswith('lacks its file bag_0.mcap')


def test_unfinished_bag_names_the_remedy(bag: Path) -> None:
    (bag / 'metadata.yaml').unlink()

    remedy = f'repair it: goalreach record --repair {bag}'
    assert refusal(bag).endswith(f'has no metadata.yaml; {remedy}')


@pytest.mark.parametrize('text', ['', ']', 'a: b', 'rosbag2_bagfile_information: {}', '\xff'])
def test_damaged_summary_is_refused(bag: Path, text: str) -> None:
    (bag / 'metadata.yaml').write_text(text, encoding='latin-1')

    assert refusal(bag).endswith('metadata.yaml: is not the metadata of a bag')


def test_what_is_no_bag_is_refused(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    (tmp_path / 'folder').mkdir()

    assert refusal(tmp_path / 'file').endswith('is not a bag: a bag is a directory')
    assert refusal(tmp_path / 'folder').endswith('is not a bag: it holds no metadata.yaml')
    assert refusal(tmp_path / 'nothing').endswith('does not exist')


def test_missing_topics_are_named(bag: Path) -> None:
    with BagReader(bag) as reader, pytest.raises(BagError, match=r'no message of /odom, /pose$'):
        reader.require(['/text', '/pose', '/odom'])


def test_offers_with_a_word_in_place_of_seconds_take_no_message_away(bag: Path) -> None:
    change(bag, 'sec: 9223372036', 'sec: x')

    assert read(bag) == 20
    with BagReader(bag) as reader:
        assert reader.topics['/text'].offers == (DEFAULT_OFFER,), 'those of the file'


@pytest.mark.parametrize(
    ('before', 'after'),
    [('reliability: reliable', 'reliability: best_effort'), ('nanoseconds: 19', 'nanoseconds: 1')],
)
def test_metadata_that_differs_from_the_file_takes_no_message_away(
    bag: Path, before: str, after: str
) -> None:
    change(bag, before, after)

    assert read(bag) == 20
    with BagReader(bag) as reader:
        assert (reader.first_ns, reader.last_ns) == (1_000_000, 20_000_000)


def test_fewer_messages_than_the_metadata_promises_are_refused(bag: Path) -> None:
    change(bag, 'message_count: 20\n  compression', 'message_count: 21\n  compression')

    assert 'holds 20 of the 21 messages that its metadata promise' in refusal(bag)


def test_names_with_the_directory_of_another_machine_are_found(bag: Path) -> None:
    change(bag, '- bag_0.mcap', '- /elsewhere/bag_0.mcap')

    assert read(bag) == 20
