"""Rows as people read them."""

from __future__ import annotations

import io
import json
import math

import pytest
from rich.console import Console

from goalreach_lab.report import bench_table, show_rows
from goalreach_lab.row import BenchRow, Goal

ROWS = (
    BenchRow(
        name='tracking frame, median, beside a peer with a long name',
        unit='ms',
        ours=0.2966,
        reference=1.062,
        reference_name='a peer with a long name on our spots',
        goal=Goal(of='ratio', relation='<=', bound=1.0),
        note='p95 0.48 beside 1.27 ms',
    ),
    BenchRow(
        name='lost',
        unit='',
        ours=3,
        goal=Goal(of='ours', relation='<=', bound=0.0),
        note='[0, 1] of 20',
    ),
)


def shown(width: int, *, terminal: bool = False) -> str:
    stream = io.StringIO()
    show_rows(ROWS, console=Console(file=stream, width=width, force_terminal=terminal))
    return stream.getvalue()


@pytest.mark.parametrize('width', [60, 80, 200])
def test_no_line_is_wider_than_the_terminal_and_figures_are_never_broken(width: int) -> None:
    lines = shown(width).splitlines()
    assert max(map(len, lines)) <= width
    assert lines == [line.rstrip() for line in lines]
    figures = [line.split() for line in lines if '<=' in line]
    assert figures[0] == ['0.2966', 'ms', '1.062', '0.279', 'ratio', '<=', '1', 'yes']
    assert figures[1] == ['3', '<=', '0', 'NO']


def test_figures_stand_below_their_headings() -> None:
    lines = shown(80).splitlines()
    head = next(line for line in lines if 'reference  ' in line)
    figures = next(line for line in lines if '0.2966' in line)
    for heading, figure in (('ours', '0.2966 ms'), ('reference', '1.062'), ('met', 'yes')):
        end = head.index(heading) + len(heading)
        assert figures[:end].endswith(figure)


def test_notes_are_told_as_they_are() -> None:
    text = shown(80)
    assert '[0, 1] of 20' in text
    assert 'reference: a peer with a long name on our spots' in text


def test_plain_text_where_there_is_no_terminal() -> None:
    assert '\x1b' not in shown(80)
    assert '\x1b' in shown(80, terminal=True)


def test_markdown_leaves_empty_columns_out() -> None:
    assert bench_table(ROWS[1:]).splitlines() == [
        '| measurement | ours | goal | met | n | note |',
        '| --- | --- | --- | --- | --- | --- |',
        '| lost | 3 | <= 0 | NO | 1 | [0, 1] of 20 |',
    ]
    assert '| 1.062 (a peer with a long name on our spots) | 0.279 |' in bench_table(ROWS)


def test_what_is_not_finite_is_none_in_json() -> None:
    never = BenchRow(name='never', unit='s', ours=math.inf, reference=math.nan)
    written = json.loads(json.dumps(never.to_json(), allow_nan=False))
    assert (written['ours'], written['reference'], written['ratio']) == (None, None, None)
    assert written['n'] == 1


def test_a_share_has_its_interval() -> None:
    row = BenchRow.share('goal', 9, 10, unit='%', least=95.0, note='; bump 1')
    assert (row.ours, row.n, row.met) == (90.0, 10, False)
    assert row.note == '95 % interval 59.58 to 98.21 %; bump 1'
