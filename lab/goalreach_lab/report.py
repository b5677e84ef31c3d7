"""Benchmark rows as a table for people and as JSON for machines."""

from collections.abc import Iterable, Iterator, Sequence
import os
import platform
from textwrap import wrap
from typing import Any, Final

from rich.console import Console
from rich.text import Text

from goalreach_lab.row import BenchRow
from goalreach_lab.template import table

_INDENT: Final = '  '
_HEADINGS: Final = ('measurement', 'ours', 'reference', 'ratio', 'goal', 'met', 'n', 'note')
_COLOURS: Final = {True: 'green', False: 'red', None: ''}


def machine() -> str:
    """Return processor, cores and Python version of this machine in one line."""
    return f'{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}'


def goals_met(rows: Iterable[BenchRow]) -> str:
    """Return how many rows met their goals, and a Markdown list of those that did not."""
    rated = [row for row in rows if row.met is not None]
    missed = [row for row in rated if not row.met]
    line = f'{len(rated) - len(missed)} of {len(rated)} goals are met.'
    if not missed:
        return line
    return f'{line} Missed:\n\n' + '\n'.join(f'* {row.name}: {_verdict(row)}' for row in missed)


def bench_table(rows: Sequence[BenchRow]) -> str:
    """Return rows as a Markdown table, without the columns that are empty in all of them."""
    cells = [
        (row.name, *_figures(row, f' ({row.reference_name})'), str(row.n), row.note)
        for row in rows
    ]
    used = [column for column in range(len(_HEADINGS)) if any(one[column] for one in cells)]
    headings = [_HEADINGS[column] for column in used]
    return table(headings, [[one[column] for column in used] for one in cells])


def _verdict(row: BenchRow) -> str:
    ratio = '' if row.ratio is None else f', ratio {row.ratio:.3g}'
    return f'{row.ours:.3g} {row.unit}{ratio}, goal {row.goal}'


def rows_to_json(rows: Sequence[BenchRow], *, seed: int) -> dict[str, Any]:
    """Return rows as the JSON object that `bench --json` writes."""
    return {'rows': [row.to_json() for row in rows], 'machine': machine(), 'seed': seed}


def show_rows(rows: Sequence[BenchRow], *, console: Console | None = None) -> None:
    """Print rows: names and notes over the full width, the figures in columns below each name."""
    out = console or Console(highlight=False)
    head = ('ours', 'reference', 'ratio', 'goal', 'met')
    figures = [
        head,
        *(
            (ours, reference.partition(' ')[0], *rest)
            for ours, reference, *rest in map(_figures, rows)
        ),
    ]
    widths = [max(len(one[column]) for one in figures) for column in range(len(head))]
    indent = 2 * _INDENT

    def line(one: Sequence[str]) -> str:
        cells = [f'{cell:>{width}}' for cell, width in zip(one, widths, strict=True)]
        return _INDENT + '  '.join(cells).rstrip()

    for row, figure in zip((None, *rows), figures, strict=True):
        if row is not None:
            out.print(Text(row.name, style='bold'))
        out.print(Text(line(figure), style='dim' if row is None else _COLOURS[row.met]))
        for note in () if row is None else _notes(row):
            wrapped = wrap(note, out.width, initial_indent=indent, subsequent_indent=indent)
            out.print(Text('\n'.join(wrapped), style='dim'))


def _figures(row: BenchRow, reference_name: str = '') -> tuple[str, ...]:
    return (
        f'{row.ours:.4g} {row.unit}'.rstrip(),
        '' if row.reference is None else f'{row.reference:.4g}{reference_name}',
        '' if row.ratio is None else f'{row.ratio:.3g}',
        '' if row.goal is None else str(row.goal),
        {True: 'yes', False: 'NO', None: ''}[row.met],
    )


def _notes(row: BenchRow) -> Iterator[str]:
    if row.reference_name:
        yield f'reference: {row.reference_name}'
    if row.note:
        yield row.note
