"""Tables about bags for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from goalreach_bringup.bags.compare import TopicComparison
from goalreach_bringup.bags.recomputation import TopicResult

__all__ = ['show_comparison', 'show_recomputation']


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


def show_recomputation(
    results: Sequence[TopicResult], *, tolerance: float, console: Console | None = None
) -> None:
    """Print what recomputing showed, topic by topic, and where it differs first."""
    out = console or Console(highlight=False)
    table = Table('topic', 'compared', 'different', 'largest difference', 'in field', 'first at')
    for result in results:
        first = result.first
        table.add_row(
            result.topic,
            str(result.compared),
            str(result.different),
            f'{result.worst:.3g}',
            result.worst_field,
            '' if first is None else f'{first.stamp_ns * 1e-9:.3f} s',
        )
    out.print(table)
    first = results[0].first
    if first is None:
        text = f'the same within {tolerance:g}'
    else:
        difference = first.difference
        text = (
            f'differs first at {first.stamp_ns * 1e-9:.3f} s in {results[0].topic}: '
            f'{difference.field} was {difference.first} and is {difference.second}'
        )
    out.print(text, soft_wrap=True, markup=False)
