"""Planted faults: found in a module, tried in a copy of the tree."""

from pathlib import Path
import sys

import pytest

from goalreach_lab.cli import main
from goalreach_lab.mutation import faults, is_noticed, planted

_ROOT = Path(__file__).resolve().parents[2]
_ANGLES = 'src/goalreach_msgs_py/goalreach_msgs_py/angles.py'
_FACE = 'src/goalreach/goalreach/__init__.py'


def test_a_fault_is_noticed_by_the_tests_of_its_module() -> None:
    text = (_ROOT / _ANGLES).read_text()
    assert 'math.pi' in text
    assert is_noticed(_ANGLES, text.replace('math.pi', '3.0'))
    assert (_ROOT / _ANGLES).read_text() == text


def test_a_comment_is_not_noticed() -> None:
    assert not is_noticed(_FACE, (_ROOT / _FACE).read_text() + '\n# Nothing.\n')


def test_annotations_are_no_faults() -> None:
    pytest.importorskip('cosmic_ray')
    source = 'def f(a: int | None, b: int) -> int:\n    return a + b\n'
    changed = {planted(source, *fault) for fault in faults(source)}
    assert None in changed
    assert {text.splitlines()[1] for text in changed if text} > {'    return a - b'}
    assert all('a: int | None' in text for text in changed if text)


def test_without_cosmic_ray_one_line_tells_how_to_get_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, 'cosmic_ray', None)
    assert main(['mutation', '--count', '1']) != 0
    assert 'pip install cosmic-ray' in capsys.readouterr().err
