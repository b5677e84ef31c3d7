"""Files: atomic writing, and YAML that was made to do harm."""

import os
from pathlib import Path
import time

import pytest
import yaml

from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, one_line_repr
from goalreach_msgs_py.files import load_yaml, write_text_atomically


def test_replaces_and_leaves_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / 'result.json'
    write_text_atomically(target, 'one')
    write_text_atomically(target, 'two')
    assert target.read_text() == 'two'
    assert list(tmp_path.iterdir()) == [target]


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    target = tmp_path / 'none' / 'result.json'
    with pytest.raises(FileFormatError, match=r'result\.json: cannot be written'):
        write_text_atomically(target, 'x')


def test_a_target_that_is_a_folder_loses_nothing(tmp_path: Path) -> None:
    (tmp_path / 'kept').mkdir()
    with pytest.raises(FileFormatError, match='cannot be written'):
        write_text_atomically(tmp_path / 'kept', 'x')
    assert [entry.name for entry in tmp_path.iterdir()] == ['kept']


def test_plain_values_are_read() -> None:
    assert load_yaml('a: [1, 2.5, x]\nb: {c: true}') == {'a': [1, 2.5, 'x'], 'b': {'c': True}}


@pytest.mark.parametrize(
    'text',
    [
        '[' * 20_000,
        '{"a":' * 20_000,
        '9' * 200_000,
        '- ' * 3000,
        'a: 2001-99-99',
        '!!python/object/apply:os.system ["true"]',
        'a: [',
        '? {a: 1}\n: b',
        '!!float ""',
        '!!int ""',
        '!!bool maybe',
        '!!timestamp x',
    ],
)
def test_what_cannot_be_a_value_is_one_kind_of_error(text: str) -> None:
    with pytest.raises(yaml.YAMLError):
        load_yaml(text)


def test_a_value_that_is_huge_when_written_out_is_told_in_short() -> None:
    lines = ['a0: &a0 [x, x, x, x, x, x, x, x, x]']
    lines += [f'a{k}: &a{k} [{", ".join([f"*a{k - 1}"] * 9)}]' for k in range(1, 12)]
    value = load_yaml('\n'.join(lines))
    began_s = time.process_time()
    assert len(str(ConfigurationError('field', value, 'small'))) < 2000
    assert time.process_time() - began_s < 2.0


def test_errors_are_one_line_whatever_is_in_the_value() -> None:
    assert '\n' not in str(ConfigurationError('a\nb', 'c\x1b[31m\nd', 'plain'))
    assert '\n' not in str(FileFormatError('file', 'two\nlines'))
    assert one_line_repr((0.1, 1.0, 0.0)) == '(0.1, 1.0, 0.0)'


def test_a_link_and_a_pipe_stay_what_they_are_and_a_private_file_private(tmp_path: Path) -> None:
    target, link, pipe = (tmp_path / name for name in ('target', 'link', 'pipe'))
    target.write_text('old')
    target.chmod(0o600)
    link.symlink_to(target)
    write_text_atomically(link, 'new')
    assert link.is_symlink()
    assert target.read_text() == 'new'
    assert target.stat().st_mode & 0o777 == 0o600
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_text_atomically(pipe, 'through')
    assert os.read(reader, 100) == b'through'
    os.close(reader)
    assert pipe.is_fifo()
