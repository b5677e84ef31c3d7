"""Printed tables about bags."""

from collections.abc import Sequence
from typing import Final

from rich.console import Console
from rich.table import Column, Table

from goalreach_bags.compare import TopicComparison, TopicResult
from goalreach_bags.reader import BagReader
from goalreach_bags.recording import CLOCK_KEY, PARAMETERS_KEY, lost_messages
from goalreach_bags.repair import inspect_bag

_NS: Final = 1e-9
_DECODED: Final = ('ros2msg', 'ros2idl', '')
_CHECKED_MB: Final = 256.0
"""Bags up to this size are read whole without being asked, in seconds. Chosen."""


def show_bag(bag: BagReader, *, check: bool | None) -> None:
    """Print a summary of a bag and its faults.

    `check` reads all of it, check sums included; None does unless it is large.
    """
    out = Console(highlight=False, markup=False)
    metadata = bag.metadata
    size_mb = sum((bag.path / file.name).stat().st_size for file in metadata.files) * 1e-6
    lasts_s = (bag.last_ns - bag.first_ns) * _NS
    lost = lost_messages(metadata.custom)
    known = PARAMETERS_KEY in metadata.custom
    distro = metadata.distro or 'unknown distro'
    clock = metadata.custom.get(CLOCK_KEY, '')
    for name, value in (
        ('bag', str(bag.path)),
        ('storage', f'{metadata.storage}, version {metadata.version}, {distro}'),
        ('files', f'{len(metadata.files)}, {size_mb:.1f} MB'),
        ('clock', {'sim': '/clock', 'wall': 'wall'}.get(clock, 'unknown')),
        ('time', f'{bag.first_ns * _NS:.3f} s to {bag.last_ns * _NS:.3f} s: {lasts_s:.3f} s'),
        ('messages', f'{sum(bag.counts.values())}, lost {sum(lost.values())}'),
        ('state', _state(bag, check=size_mb <= _CHECKED_MB if check is None else check)),
        ('parameters', 'those of the run are kept' if known else 'unknown'),
    ):
        out.print(f'{name + ":":<12}{value}', soft_wrap=True)
    table = Table(Column('topic', no_wrap=True), 'type', 'messages', 'per second', 'lost')
    for name, topic in sorted(bag.topics.items()):
        count = bag.counts[name]
        rate = f'{(count - 1) / lasts_s:.2f}' if lasts_s > 0.0 and count > 1 else ''
        table.add_row(name, topic.type_name, str(count), rate, str(lost.get(name, 0)))
    out.print(table)
    for name, topic in sorted(bag.topics.items()):
        if topic.serialization != 'cdr' or topic.encoding not in _DECODED:
            kinds = f'message encoding {topic.serialization!r}, schema encoding {topic.encoding!r}'
            out.print(f'{name} cannot be decoded here: {kinds}', soft_wrap=True)


def _state(bag: BagReader, *, check: bool) -> str:
    if not check:
        return 'not checked: --check reads all of it'
    problems, advice = inspect_bag(bag.path)
    state = '' if advice.startswith('not checked') else 'sound'
    return ('\n' + 12 * ' ').join(filter(None, [*(problems or [state]), advice]))


def show_comparison(comparisons: Sequence[TopicComparison]) -> None:
    """Print the comparison of two bags, topic by topic, and the first difference of all."""
    out = Console(highlight=False, markup=False)
    table = Table(Column('topic', no_wrap=True), 'messages', 'first difference')
    for comparison in comparisons:
        first, second = comparison.counts
        counts = str(first) if first == second else f'{first} and {second}'
        table.add_row(comparison.topic, counts, comparison.where or 'same')
    out.print(table)
    different = [c for c in comparisons if not c.same]
    if different:
        text = f'{len(different)} of {len(comparisons)} topics differ, first '
        text += f'{different[0].topic}: {different[0].where}'
    else:
        total = sum(c.counts[0] for c in comparisons)
        text = f'the same: {total} messages of {len(comparisons)} topics'
    out.print(text, soft_wrap=True)


def show_recomputation(results: Sequence[TopicResult], *, tolerance: float) -> None:
    """Print the result of a recomputation, topic by topic, and the first difference."""
    out = Console(highlight=False, markup=False)
    table = Table(Column('topic', no_wrap=True), 'compared', 'different', 'largest', 'first at')
    for result in results:
        first = result.first
        table.add_row(
            result.topic,
            str(result.compared),
            str(result.different),
            f'{result.worst:.3g} {result.worst_field}'.strip(),
            '' if first is None else f'{result.first_ns * _NS:.3f} s {first.field}',
        )
    out.print(table)
    first = results[0].first
    text = f'the same within {tolerance:g}'
    if first is not None:
        text = (
            f'differs first at {results[0].first_ns * _NS:.3f} s in {results[0].topic}: '
            f'{first.field} was {first.first} and is {first.second}'
        )
    out.print(text, soft_wrap=True)
