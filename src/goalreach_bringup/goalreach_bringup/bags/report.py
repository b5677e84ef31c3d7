"""Tables about bags for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from goalreach_bringup.bags.compare import TopicComparison

__all__ = ['show_comparison']


def show_comparison(
    comparisons: Sequence[TopicComparison], *, console: Console | None = None
) -> None:
    """Print the comparison of two bags, topic by topic, and the first difference of all."""
    out = console or Console(highlight=False)
    table = Table('topic', 'messages', 'first difference')
    for comparison in comparisons:
        first, second = comparison.counts
        counts = str(first) if first == second else f'{first} and {second}'
        table.add_row(comparison.topic, counts, comparison.where or 'same')
    out.print(table)
    different = [c for c in comparisons if not c.same]
    total = sum(c.counts[0] for c in comparisons)
    if different:
        first_of_all = different[0]
        out.print(
            f'{len(different)} of {len(comparisons)} topics differ, first '
            f'{first_of_all.topic}: {first_of_all.where}',
            soft_wrap=True,
            markup=False,
        )
    else:
        out.print(f'the same: {total} messages of {len(comparisons)} topics', soft_wrap=True)
