"""docs/PERFORMANCE.md: how fast everything is, beside floors and peers, measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path

from goalreach_lab.report import goals_met, machine
from goalreach_lab.row import BenchRow
from goalreach_lab.speed.driving import profile_driving
from goalreach_lab.speed.groups import GROUPS
from goalreach_lab.speed.measurement import Budget
from goalreach_lab.template import table
from goalreach_msgs_py.files import write_text_atomically

_PROFILED_PATHS = 22
_PROFILE = """\
By `cProfile`, over drives in one process; what a module calls of numpy, OpenCV and the
interpreter counts as its own. A profiler makes calls dearer than work in C."""

_HOW_TO_ADD = """\
## How to add a row

Write a function that takes a `Budget` (seed, and how much it may cost) and returns `BenchRow`s, in
a module of `goalreach_bringup/performance/`: measure ours and the reference in turns, give the
medians to the row, and the spread to its note (`samples.spread`). Then name the function in
`performance/groups.py`, with the text that explains it and, for the day when the goal is missed,
where the time goes. A graph is measured from outside: `Stand` starts ours, the relay or bare nodes
in a domain of their own, and `ros_probe` looks at each in the same way."""


def write_document(path: Path, rows: Mapping[str, Sequence[BenchRow]], budget: Budget) -> None:
    """Write the document.

    Args:
        path: The file.
        rows: By group.
        budget: What they were measured with.

    Raises:
        FileFormatError: It cannot be written.
    """
    parts = [_introduction(budget), goals_met(chain.from_iterable(rows.values()))]
    for name, found in rows.items():
        group = GROUPS[name]
        parts += [f'## {group.title}', group.text, _table(found)]
        if group.profile and any(row.met is False for row in found):
            parts += [f'Where the time goes: {group.profile}']
    parts += _profile(budget) if 'driving' in rows else []
    write_text_atomically(path, '\n\n'.join([*parts, _HOW_TO_ADD]) + '\n')


def _introduction(budget: Budget) -> str:
    scale = '' if budget.scale == 1.0 else f' --scale {budget.scale:g}'
    return f"""# Performance, measured

Written by `goalreach bench --seed {budget.seed}{scale} --out docs/PERFORMANCE.md`; every number
comes from that command. Each row is our figure, what it is held against, measured in the same run
on the same machine in turns, and their ratio; figures are medians, the spread is beside them.
Measured on {machine()}. Absolute figures are those of that machine; ratios carry over."""


def _table(rows: Sequence[BenchRow]) -> str:
    cells = []
    for row in rows:
        beside = '' if row.reference is None else f'{row.reference:.3g} ({row.reference_name})'
        ratio = '' if row.ratio is None else f'{row.ratio:.3g}'
        met = {True: 'yes', False: 'no', None: ''}[row.met]
        ours = f'{row.ours:.3g} {row.unit}'.strip()
        cells.append((row.name, ours, beside, ratio, row.goal or '', met, row.n, row.note))
    return table(('what', 'ours', 'beside', 'ratio', 'goal', 'met', 'n', 'more'), cells)


def _profile(budget: Budget) -> list[str]:
    """Return the profile that tells where the time of a frame goes."""
    shares = profile_driving(budget.seed, paths=budget.count(_PROFILED_PATHS))
    cells = [(share.module, f'{share.percent:.1f} %') for share in shares]
    return [
        '## Where the time of a frame goes',
        _PROFILE,
        table(('module', 'share'), cells),
    ]
