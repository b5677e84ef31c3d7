"""Files that are written whole or not at all."""

from pathlib import Path

import pytest

from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.files import write_text_atomically


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
