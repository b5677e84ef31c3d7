from __future__ import annotations

import io
import math
from pathlib import Path

import pytest

from goalreach_bringup.cli import main
from goalreach_msgs_py.arena_file import read_arena


def answer(monkeypatch: pytest.MonkeyPatch, path: Path, *lines: str) -> int:
    monkeypatch.setattr('sys.stdin', io.StringIO(''.join(f'{line}\n' for line in lines)))
    return main(['new-arena', '--out', str(path)])


def test_empty_answers_make_a_room_with_six_tags_and_a_drawing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / 'room.yaml'
    assert answer(monkeypatch, path, '4', '', '', '') == 0
    arena = read_arena(path)
    assert (arena.name, arena.width_m, arena.length_m) == ('room', 4.0, 3.0)
    assert [(tag.id, tag.x_m, tag.y_m) for tag in arena.tags] == [
        (0, 1.0, 0.0), (1, 3.0, 0.0), (2, 4.0, 1.5), (3, 3.0, 3.0), (4, 1.0, 3.0), (5, 0.0, 1.5)
    ]  # fmt: skip
    assert [round(math.degrees(tag.facing_rad)) for tag in arena.tags] == [
        90,
        90,
        180,
        -90,
        -90,
        0,
    ]
    assert {(tag.size_m, tag.z_m) for tag in arena.tags} == {(0.16, 1.2)}
    # Borders at a third and at two thirds, with transitions of 0.15 of the shorter side.
    assert arena.regions.x_knots_m == pytest.approx((0.0, 1.108, 1.558, 2.442, 2.892, 4.0))
    assert path.with_suffix('.svg').read_text().startswith('<?xml')
    assert main(['tags', '--arena', str(path), '--out', str(tmp_path / 'tags.pdf')]) == 0
    assert (tmp_path / 'tags.pdf').read_bytes().startswith(b'%PDF')
    told = capsys.readouterr().out
    assert str(path) in told
    assert 'width of the room, m [3.0]: length of the room, m [3.0]: ' in told
    assert '\nlandmark: goal' in told


def test_landmarks_are_leds_and_tags_and_a_wrong_answer_is_asked_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    leds = ['0.5 0 1.4', '1.5, 0.3, 1.8', '2.5 0 1.6']
    lines = [
        'three',
        '3',
        '2.5',
        *leds,
        '1 2',
        'inf 0.2 1 0 1 0',
        '1.7 0.2 1 0 1 0',
        '7 0.2 1 0 1.3 90',
        '',
        'RIGHT-SIDE/NEAR',
    ]
    assert answer(monkeypatch, tmp_path / 'room.yaml', *lines) == 0
    arena = read_arena(tmp_path / 'room.yaml')
    assert arena.landmarks_m == ((0.5, 0.0, 1.4), (1.5, 0.3, 1.8), (2.5, 0.0, 1.6))
    assert [(tag.id, tag.size_m) for tag in arena.tags] == [(7, 0.2)]
    assert arena.regions.goal == (2, 0)
    assert arena.regions.y_knots_m[1:3] == pytest.approx((0.833 - 0.1875, 0.833 + 0.1875))
    told = capsys.readouterr().out
    assert 'not understood: three' in told
    for row in ('1 2', 'inf 0.2 1 0 1 0', '1.7 0.2 1 0 1 0'):
        assert f'not understood: {row}' in told


@pytest.mark.parametrize(
    ('lines', 'reason'),
    [
        (('3', '4', '', 'NOWHERE'), 'regions.goal'),
        (('3', '4', '0 0.2 9 0 1.3 90', '', ''), r'tags[0]'),
        (('nan', '4', '', ''), 'width_m'),
    ],
)
def test_answers_that_make_no_arena_get_one_line_and_are_kept_to_be_corrected(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    lines: tuple[str, ...],
    reason: str,
) -> None:
    draft = tmp_path / 'room.yaml.draft'
    assert answer(monkeypatch, tmp_path / 'room.yaml', *lines) == 2
    assert capsys.readouterr().err.startswith(f'goalreach new-arena: {draft}: {reason}')
    assert list(tmp_path.iterdir()) == [draft]
    assert draft.read_text().startswith(f"name: 'room'\nwidth_m: {float(lines[0])}\n")


def test_without_the_last_answers_there_is_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert answer(monkeypatch, tmp_path / 'room.yaml', '3') == 2
    assert 'no answer: length of the room, m' in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_an_arena_that_is_there_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / 'room.yaml').write_text('mine')
    assert answer(monkeypatch, tmp_path / 'room.yaml', '', '', '', '') == 2
    assert (tmp_path / 'room.yaml').read_text() == 'mine'


def test_an_arena_without_tags_has_no_pages(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(['tags', '--out', str(tmp_path / 'tags.pdf')]) == 2
    assert "--arena = 'paper': must be one with tags" in capsys.readouterr().err
