"""What a page holds over a day, from the minutes that were kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from goalreach_evaluation.results_file import ResultsFile
from goalreach_lab.cli import main
from goalreach_lab.speed.dashboard_day import compare_ends, longest_stretch


def day(page_mb: Callable[[int], float], minutes: int = 120) -> list[dict[str, Any]]:
    return [
        {
            'page': 'one',
            'clock_s': 60.0 * minute,
            'page_mb': page_mb(minute),
            'browser_mb': 250.0,
            'heap_mb': 3.0,
            'nodes': 950,
            'handles': 35,
            'threads': 26,
            'frames': 100,
        }
        for minute in range(1, minutes + 1)
    ]


def test_what_stays_flat_is_flat() -> None:
    rows = compare_ends(day(lambda _: 100.0))
    assert [row.ratio for row in rows] == [1.0] * 6
    assert all(row.met is not False for row in rows)
    assert rows[0].note == '2.00 h simulated, 12000 frames'


def test_what_grows_is_told() -> None:
    row = compare_ends(day(lambda minute: 100.0 + minute))[0]
    assert row.reference == pytest.approx(109.5)  # minutes 2 to 17
    assert row.ours == pytest.approx(212.5)  # minutes 105 to 120
    assert row.met is False


def test_garbage_is_not_held() -> None:
    minutes = day(lambda _: 100.0)
    for number, minute in enumerate(minutes):
        minute['nodes'] += 300 if number % 4 else 0
    (row,) = [row for row in compare_ends(minutes) if 'nodes' in row.name]
    assert row.ours == row.reference == 950


def test_warming_up_does_not_count() -> None:
    assert compare_ends(day(lambda minute: 50.0 if minute < 2 else 100.0))[0].ratio == 1.0
    assert compare_ends(day(lambda _: 100.0, minutes=1)) == []


def test_a_page_opened_later_is_another() -> None:
    first, second = day(lambda _: 1.0, minutes=5), day(lambda _: 2.0, minutes=9)
    for minute in second:
        minute['page'] = 'two'
    assert longest_stretch([*first, *second]) == second
    assert longest_stretch([]) == []


def test_what_was_kept_is_reported_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / 'day.jsonl'
    file = ResultsFile(path, key=('page', 'clock_s'))
    for minute in day(lambda _: 100.0):
        file.add(minute, minute)
    assert main(['page-day', '--lines', str(path), '--as-it-is']) == 0
    assert '2.00 h simulated' in capsys.readouterr().out


@pytest.mark.parametrize('words', [['--hours', '0'], ['--hours', 'nan'], ['--as-it-is']])
def test_what_makes_no_sense_is_refused(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(['page-day', *words]) == 2
    assert 'bench: --' in capsys.readouterr().err
