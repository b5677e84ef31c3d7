"""MCAP files of every layout: read whole and never changed; repaired where damaged."""

from collections import Counter
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

from mcap.reader import NonSeekingReader
import pytest

from goalreach_bags.reader import BagReader
from goalreach_bags.repair import repair_bag
from goalreach_bags.report import show_bag
from goalreach_bringup.cli import main
from goalreach_lab.fuzz.mcap_layouts import COUNT, UNKNOWN, McapLayout, layout_reader, mcap_layouts
from goalreach_lab.fuzz.reader import try_inputs

LAYOUTS = mcap_layouts()
CONTENTS = sorted({layout.content for layout in LAYOUTS})


def find_layout(content: str, **options: object) -> McapLayout:
    """Return the first layout with a content and some options."""
    return next(
        layout
        for layout in LAYOUTS
        if layout.content == content and options.items() <= layout.options.items()
    )


def write(layout: McapLayout, bag: Path) -> bytes:
    bag.mkdir()
    data = layout.encode()
    (bag / 'a.mcap').write_bytes(data)
    return data


def counts_of(data: bytes) -> Counter[str]:
    """Return the messages of each topic as mcap's own reader finds them."""
    messages = NonSeekingReader(BytesIO(data), validate_crcs=True).iter_messages()
    return Counter(channel.topic for _, channel, _ in messages)


def test_layouts_differ_in_all_that_the_format_allows() -> None:
    profiles = {layout.profile for layout in LAYOUTS}
    assert profiles == {'', 'ros2', 'ros1'}
    names = LAYOUTS[0].options
    varied = {n for n in names if len({str(layout.options[n]) for layout in LAYOUTS}) > 1}
    assert varied == set(names)
    assert counts_of(find_layout('everything').encode()) == {'/text': COUNT, '/other': COUNT}


@pytest.mark.parametrize('content', CONTENTS)
def test_healthy_file_is_read_whole_and_left_alone(
    tmp_path: Path, content: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for number, layout in enumerate(one for one in LAYOUTS if one.content == content):
        bag = tmp_path / str(number)
        data = write(layout, bag)

        result = repair_bag(bag)

        assert result.damage == {}, layout
        assert repair_bag(bag).was_sound
        expected = counts_of(data)
        with BagReader(bag) as reader:
            assert Counter(message.topic for message in reader.messages()) == expected, layout
            for topic, count in expected.items():
                assert len(list(reader.messages([topic]))) == reader.counts[topic] == count
            times = [message.time_ns for message in reader.messages()]
            assert times == sorted(times), 'in the order of time, whatever that in the file is'
            show_bag(reader, check=True)
        assert 'state:      sound' in capsys.readouterr().out
        assert result.messages == expected.total()
        assert (bag / 'a.mcap').read_bytes() == data


def test_damaged_file_keeps_every_sound_message_and_the_original(tmp_path: Path) -> None:
    tally = try_inputs(layout_reader(tmp_path, LAYOUTS), range(300))

    assert not tally.tracebacks
    assert not tally.hangs
    assert tally.accepted > 280, 'only what holds nothing is refused'


def length_of_first_chunk(data: bytearray) -> None:
    data[data.index(b'\6', 8 + 25) + 1] ^= 0x40


def opcode_of_first_chunk(data: bytearray) -> None:
    data[data.index(b'\6', 8 + 25)] = 0x86


def first_byte(data: bytearray) -> None:
    data[0] ^= 1


def last_byte(data: bytearray) -> None:
    data[-1] ^= 1


@pytest.mark.parametrize(
    ('damage', 'complete'),
    [
        (length_of_first_chunk, False),
        (opcode_of_first_chunk, False),
        (first_byte, True),
        (last_byte, True),
    ],
)
def test_chunks_after_a_damage_are_kept(
    tmp_path: Path, damage: Callable[[bytearray], None], *, complete: bool
) -> None:
    layout = find_layout('ordered', use_statistics=False, repeat_channels=False, enable_crcs=True)
    chunked = McapLayout(
        content='ordered', profile='', options={**layout.options, 'use_chunking': True}
    )
    data = bytearray(write(chunked, tmp_path / 'bag'))
    damage(data)
    (tmp_path / 'bag' / 'a.mcap').write_bytes(data)

    result = repair_bag(tmp_path / 'bag')

    assert (tmp_path / 'bag' / 'a.mcap.damaged').read_bytes() == data
    with BagReader(tmp_path / 'bag') as bag:
        found = Counter(message.topic for message in bag.messages())
    assert found.total() == result.messages
    if complete:
        assert found == {'/text': COUNT, '/other': COUNT}
    else:
        # The names of the channels were in the first chunk alone.
        assert found.keys() == {'/unknown_1', '/unknown_2'}
        assert found.total() > COUNT


def test_unknown_record_after_a_damaged_chunk_is_kept(tmp_path: Path) -> None:
    layout = find_layout('everything', use_chunking=True, enable_crcs=True)
    data = bytearray(write(layout, tmp_path / 'bag'))
    data[data.index(UNKNOWN) - 1] ^= 1
    (tmp_path / 'bag' / 'a.mcap').write_bytes(data)

    assert repair_bag(tmp_path / 'bag').damage

    assert (tmp_path / 'bag' / 'a.mcap').read_bytes().count(UNKNOWN) == 2


@pytest.mark.parametrize('content', CONTENTS)
def test_commands_take_such_files(
    tmp_path: Path, content: str, capsys: pytest.CaptureFixture[str]
) -> None:
    data = write(find_layout(content), tmp_path / 'bag')

    def run(*words: str) -> str:
        assert main([*words, str(tmp_path / 'bag')]) == 0
        return capsys.readouterr().out

    assert 'repaired' in run('record', '--repair')
    assert 'nothing to repair' in run('record', '--repair')
    assert f'messages:   {counts_of(data).total()}, ' in run('bag', 'info')
    assert (tmp_path / 'bag' / 'a.mcap').read_bytes() == data
    assert {file.name for file in (tmp_path / 'bag').iterdir()} == {'a.mcap', 'metadata.yaml'}
