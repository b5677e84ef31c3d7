"""What is the matter with a bag is said in a format's terms; repair is advised where it helps."""

from collections.abc import Callable
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import IndexType
import pytest
import zstandard

from goalreach_bags.reader import BagReader
from goalreach_bags.repair import inspect_bag, repair_bag
from goalreach_bags.report import show_bag
from goalreach_bags.storage import BagError
from small_bags import string_topic, text_message, texts, write_bag, write_foreign


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    write_bag(tmp_path / 'bag', texts(20, 100_000))
    return tmp_path / 'bag'


def flip(bag: Path, chunk: int) -> None:
    """Change a byte in a chunk."""
    path = bag / 'bag_0.mcap'
    with path.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    data = bytearray(path.read_bytes())
    data[summary.chunk_indexes[chunk].chunk_start_offset + 1000] ^= 1
    path.write_bytes(data)


def cut(bag: Path) -> None:
    path = bag / 'bag_0.mcap'
    path.write_bytes(path.read_bytes()[:-300])


def miscount(bag: Path) -> None:
    path = bag / 'metadata.yaml'
    path.write_text(path.read_text().replace('message_count: 20', 'message_count: 5'))


def statistics(bag: Path) -> None:
    """Let statistics and their check sum promise another number."""
    path = bag / 'bag_0.mcap'
    data, footer = path.read_bytes()[:-37], path.read_bytes()[-37:]
    changed = data.replace((20).to_bytes(8, 'little'), (25).to_bytes(8, 'little'))
    path.write_bytes(changed + footer[:-12] + bytes(4) + footer[-8:])


@pytest.mark.parametrize(
    ('damage', 'problem'),
    [
        (cut, 'bag_0.mcap: no footer: it was not closed by its recorder'),
        (lambda bag: flip(bag, 1), 'bag_0.mcap: chunk 2 at byte '),
        (statistics, 'bag_0.mcap: its statistics promise 25 messages and 20 are there'),
        (miscount, 'metadata.yaml: counts 5 messages of /text, the files hold 20'),
        (lambda bag: (bag / 'metadata.yaml').unlink(), 'metadata.yaml: is missing'),
    ],
)
def test_damage_is_named_and_repaired(
    bag: Path, damage: Callable[[Path], None], problem: str
) -> None:
    damage(bag)

    (first, *_), advice = inspect_bag(bag)

    assert first.startswith(problem)
    assert advice == f'repair it: goalreach record --repair {bag}'
    repair_bag(bag)
    assert inspect_bag(bag) == ((), '')


def test_unknown_compression_of_chunks_is_named_without_advice(tmp_path: Path) -> None:
    path = tmp_path / 'bag' / 'a.mcap'
    write_foreign(path)
    repair_bag(tmp_path / 'bag')
    path.write_bytes(path.read_bytes().replace(b'zstd', b'brtl'))

    known = "a.mcap: compression 'brtl' of its chunks is not known: lz4 and zstd are"
    assert inspect_bag(tmp_path / 'bag') == ((known,), '')
    with BagReader(tmp_path / 'bag') as bag, pytest.raises(BagError, match=known):
        list(bag.messages())


@pytest.mark.parametrize('options', [{'index_types': IndexType.NONE}, {'use_chunking': False}])
def test_file_without_an_index_is_sound(tmp_path: Path, options: dict[str, object]) -> None:
    write_foreign(tmp_path / 'bag' / 'a.mcap', **options)
    repair_bag(tmp_path / 'bag')

    remark = 'a.mcap: no index, so it is read from its beginning'
    assert inspect_bag(tmp_path / 'bag') == ((), remark)


def test_compressed_files_are_read_and_never_advised_to_be_repaired(tmp_path: Path) -> None:
    write_bag(tmp_path / 'bag', texts(20))
    path, packed = tmp_path / 'bag' / 'bag_0.mcap', tmp_path / 'bag' / 'bag_0.mcap.zstd'
    packed.write_bytes(zstandard.compress(path.read_bytes()))
    path.unlink()
    metadata = tmp_path / 'bag' / 'metadata.yaml'
    text = (
        metadata.read_text()
        .replace("format: ''", 'format: zstd')
        .replace('bag_0.mcap', packed.name)
    )
    metadata.write_text(text.replace("mode: ''", 'mode: FILE'))

    with BagReader(tmp_path / 'bag') as bag:
        assert len(list(bag.messages())) == 20
    assert inspect_bag(tmp_path / 'bag')[0] == ()

    packed.write_bytes(packed.read_bytes()[:-40])
    with pytest.raises(BagError, match=r'bag_0\.mcap\.zstd: its zstd frame is cut short$'):
        BagReader(tmp_path / 'bag')
    metadata.unlink()
    with pytest.raises(BagError, match=r'files that are compressed as a whole need it$'):
        BagReader(tmp_path / 'bag')


def test_info_names_what_cannot_be_decoded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    topics = [string_topic(), string_topic('/other', type_name='a/msg/B', encoding='omgidl')]
    write_bag(tmp_path / 'bag', [('/text', 1, text_message('a'))], topics=topics)

    with BagReader(tmp_path / 'bag') as bag:
        show_bag(bag, check=None)
        shown = capsys.readouterr().out
        show_bag(bag, check=False)

    assert 'state:      sound\n' in shown
    assert (
        "/other cannot be decoded here: message encoding 'cdr', schema encoding 'omgidl'" in shown
    )
    assert 'not checked: --check reads all of it' in capsys.readouterr().out


def test_a_compressed_bag_without_a_message_has_no_fault(tmp_path: Path) -> None:
    write_bag(tmp_path / 'bag', [], storage='sqlite3', zstd=True)
    assert inspect_bag(tmp_path / 'bag') == ((), '')
