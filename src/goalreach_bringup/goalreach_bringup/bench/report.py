"""Benchmark rows as a table for people and as JSON for machines."""

from __future__ import annotations

from collections.abc import Sequence
import os
import platform
from typing import Any

from rich.console import Console
from rich.table import Table

from goalreach_bringup.bench.row import BenchRow

__all__ = ['machine', 'rows_to_json', 'show_rows']


def machine() -> str:
    """Return what machine this is, in one line."""
    return f'{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}'


def rows_to_json(rows: Sequence[BenchRow], *, seed: int) -> dict[str, Any]:
    """Return rows as the JSON object that `bench --json` writes."""
    return {'rows': [row.to_json() for row in rows], 'machine': machine(), 'seed': seed}


def show_rows(rows: Sequence[BenchRow], *, console: Console | None = None) -> None:
    """Print rows as a table."""
    table = Table()
    table.add_column('what')
    for heading in ('ours', 'reference', 'ratio', 'goal', 'met'):
        table.add_column(heading, justify='right')
    for row in rows:
        reference = '' if row.reference is None else f'{row.reference:.4g} {row.reference_name}'
        table.add_row(
            row.name + (f'\n[dim]{row.note}[/dim]' if row.note else ''),
            f'{row.ours:.4g} {row.unit}',
            reference,
            '' if row.ratio is None else f'{row.ratio:.3g}',
            '' if row.goal is None else str(row.goal),
            {True: 'yes', False: 'NO', None: ''}[row.met],
        )
    (console or Console(highlight=False)).print(table)
