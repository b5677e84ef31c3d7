"""The tables of REPRODUCTION.md, in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import statistics
from typing import Any

from goalreach_evaluation.path_metrics import wilson_interval
from goalreach_lab.reproduction.equation_3 import BLENDS
from goalreach_lab.reproduction.intervals import difference_of_shares, mean_interval
from goalreach_lab.reproduction.study import OUTCOMES, DrivenPath, goals
from goalreach_msgs_py.angles import INCH_M


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table."""
    lines = ['| ' + ' | '.join(headings) + ' |', '|' + ' --- |' * len(headings)]
    lines += ['| ' + ' | '.join(str(cell) for cell in row) + ' |' for row in rows]
    return '\n'.join(lines)


def share(count: int, n: int) -> str:
    """Return a share with its interval, in percent; words where there is nothing to share."""
    if n == 0:
        return 'not measured'
    low, high = wilson_interval(count, n)
    return f'{100 * count / n:.2f} % [{100 * low:.2f}, {100 * high:.2f}]'


def rows_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows of a benchmark as a table."""
    return table(
        ('what', 'measured', 'aim', 'n', 'more'),
        (
            (
                row['name'],
                f'{row["ours"]:.4g} {row["unit"]}',
                row['goal'] or '',
                row['n'],
                row['note'],
            )
            for row in rows
        ),
    )


def outcome_table(driven: Mapping[tuple[str, str, str], Sequence[DrivenPath]]) -> str:
    """Return how the paths ended, for each noise, mode and kind of starts."""
    rows = []
    for (noise, mode, kind), paths in driven.items():
        if not paths:
            continue
        counts = [sum(path.outcome == outcome for path in paths) for outcome in OUTCOMES]
        error_in = statistics.fmean(path.error_rms_m for path in paths) / INCH_M
        rows.append(
            (
                noise,
                mode,
                kind,
                len(paths),
                share(counts[0], len(paths)),
                *counts[1:],
                f'{error_in * INCH_M:.4f} m ({error_in:.2f} in)',
            )
        )
    headings = ('noise', 'mode', 'starts', 'paths', 'goal, with 95 % interval')
    return table((*headings, *OUTCOMES[1:], 'position error, mean of rms'), rows)


def mode_table(driven: Mapping[tuple[str, str, str], Sequence[DrivenPath]]) -> str:
    """Return what driving costs in each mode, on the same nominal starts of either kind."""
    modes = [mode for noise, mode, _ in driven if noise == 'nominal']
    modes = list(dict.fromkeys(modes))
    kinds = list(dict.fromkeys(kind for noise, _, kind in driven if noise == 'nominal'))
    least = {
        kind: min(len(driven.get(('nominal', mode, kind), ())) for mode in modes) for kind in kinds
    }
    rows = []
    for mode in modes:
        paths = [path for kind in kinds for path in driven['nominal', mode, kind][: least[kind]]]
        good = goals(paths)
        if not good:
            continue
        cells = [
            mean_interval([path.duration_s for path in good]),
            mean_interval([path.turning_deg for path in good]),
            mean_interval([path.length_m for path in good]),
            mean_interval([path.length_m / path.shortest_m for path in good]),
        ]
        steps = sorted(path.step_deg for path in paths)
        rows.append(
            (
                mode,
                len(good),
                *(f'{mean:.3g} ± {half:.2g}' for mean, half in cells),
                f'{statistics.median(steps):.1f}',
                f'{steps[-1]:.1f}',
            )
        )
    headings = ('mode', 'paths to the goal', 'time, s', 'turning, deg', 'length, m')
    last = ('length / shortest', 'heading step: median, deg', 'largest, deg')
    return table((*headings, *last), rows)


def blend_table(found: Mapping[str, Any]) -> str:
    """Return what the three blends do without noise."""
    return table(
        ('blend', 'largest jump of the heading at a border', 'at x, y', 'goal reached'),
        (
            (
                mode,
                f'{found[mode]["jump"]["deg"]:.1f} deg',
                ', '.join(f'{place_m:.2f} m' for place_m in found[mode]['jump']['at_m']),
                share(found[mode]['goal'], found['starts']),
            )
            for mode in BLENDS
        ),
    )


def learned_table(without: Sequence[DrivenPath], images: Sequence[DrivenPath]) -> str:
    """Return how policies drive with images that were learned without and with them.

    Args:
        without: Paths of the policies learned without noise.
        images: Paths of those learned through images, from the same starts.
    """
    n, m = len(without), len(images)
    if not n or not m:
        return 'Not measured yet.'
    good, seen = len(goals(without)), len(goals(images))
    change, low, high = difference_of_shares((seen, m), (good, n))
    pairs = [
        (a, b) for a, b in zip(without, images, strict=False) if a.outcome == b.outcome == 'goal'
    ]
    rows: list[tuple[str, str, str, str]] = [
        (
            'goal reached',
            share(good, n),
            share(seen, m),
            f'{100 * change:+.2f} % [{100 * low:+.2f}, {100 * high:+.2f}]',
        )
    ]
    for name, field in (('time, s', 'duration_s'), ('length, m', 'length_m')):
        a, b = ([getattr(pair[k], field) for pair in pairs] for k in (0, 1))
        mean, half = mean_interval([y - x for x, y in zip(a, b, strict=True)])
        rows.append(
            (
                f'{name}, mean',
                f'{statistics.fmean(a):.3f}',
                f'{statistics.fmean(b):.3f}',
                f'{mean:+.3f} [{mean - half:+.3f}, {mean + half:+.3f}]',
            )
        )
    return table(('', 'learned without noise', 'learned with images', 'difference'), rows)


def arena_table(driven: Mapping[str, Sequence[DrivenPath]]) -> str:
    """Return how the example arenas are driven, fuzzy, with nominal noise."""
    return table(
        ('arena', 'paths', 'goal, with 95 % interval', 'largest heading step, deg'),
        (
            (
                name,
                len(paths),
                share(len(goals(paths)), len(paths)),
                f'{max(path.step_deg for path in paths):.1f}',
            )
            for name, paths in driven.items()
            if paths
        ),
    )
