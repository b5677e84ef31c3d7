"""The tables and figures of REPRODUCTION.md; its text is in `reproduction.md`."""

from collections.abc import Mapping, Sequence
import math
import statistics
from typing import Any

from scipy.stats import norm, sem

from goalreach_evaluation.path_metrics import wilson_interval
from goalreach_lab.report import bench_table, machine
from goalreach_lab.reproduction.driving_study import OUTCOMES, DrivenPath, to_goal
from goalreach_lab.reproduction.learning import SETTLED, SUCCESS, VALUES
from goalreach_lab.row import BenchRow
from goalreach_lab.template import table
from goalreach_learning.controller_config import ControllerConfig
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.parameters import flatten_config, parameter_infos
from goalreach_msgs_py.regions import DEFAULT_X_KNOTS_M, DEFAULT_Y_KNOTS_M

Conditions = Mapping[tuple[str, str, str], Sequence[DrivenPath]]
"""Paths by noise, mode and kind of starts."""


def mean_interval(values: Sequence[float]) -> tuple[float, float]:
    """Return a mean and half the width of its 95 % interval, by the normal approximation.

    Args:
        values: At least one; the width of a single one is NaN.
    """
    half = norm.ppf(0.975) * sem(values) if len(values) > 1 else math.nan
    return statistics.fmean(values), float(half)


def difference_of_shares(
    first: tuple[int, int], second: tuple[int, int]
) -> tuple[float, float, float]:
    """Return the difference of two shares and its 95 % interval.

    Newcombe's hybrid score interval (Statistics in Medicine 17, 1998, method 10), from the two
    Wilson intervals.

    Args:
        first: Successes and number of the first.
        second: Successes and number of the second.
    """
    p, q = first[0] / first[1], second[0] / second[1]
    (p_low, p_high), (q_low, q_high) = wilson_interval(*first), wilson_interval(*second)
    below = math.hypot(p - p_low, q_high - q)
    above = math.hypot(p_high - p, q - q_low)
    return p - q, p - q - below, p - q + above


def share(count: int, n: int) -> str:
    """Return a share with its interval, in percent; 'not measured' without samples."""
    if n == 0:
        return 'not measured'
    low, high = wilson_interval(count, n)
    return f'{100 * count / n:.2f} % [{100 * low:.2f}, {100 * high:.2f}]'


def _goal_share(paths: Sequence[DrivenPath]) -> str:
    return share(len(to_goal(paths)), len(paths))


def learning_values(rows: Sequence[BenchRow]) -> dict[str, object]:
    """Return the placeholders of the learning study; None where it was not run."""
    by_name = {row.name: row for row in rows}
    if SUCCESS not in by_name:
        return dict.fromkeys(
            ('learning', 'seeds', 'success', 'success_note', 'settled', 'slowest', 'value_error')
        )
    success, settled, values = by_name[SUCCESS], by_name[SETTLED], by_name[VALUES]
    return {
        'learning': bench_table(rows),
        'seeds': success.n,
        'success': f'{success.ours:.2f}',
        'success_note': success.note,
        'settled': f'{settled.ours:.0f}',
        'slowest': settled.note,
        'value_error': f'{values.ours:.3f}',
    }


def driving_values(driven: Conditions) -> dict[str, object]:
    """Return the placeholders of the conditions driven; None where none was."""
    if not any(driven.values()):
        return dict.fromkeys(('nominal', 'harsh', 'outcomes', 'modes'))

    def reached(noise: str) -> str:
        paths = [
            path
            for (one, mode, _), some in driven.items()
            for path in some
            if (one, mode) == (noise, 'fuzzy')
        ]
        return f'{_goal_share(paths)} of {len(paths)} paths'

    return {
        'nominal': reached('nominal'),
        'harsh': reached('harsh'),
        'outcomes': outcome_table(driven),
        'modes': mode_table(driven),
    }


def from_same_starts(conditions: Sequence[Sequence[DrivenPath]]) -> list[list[DrivenPath]]:
    """Return, of each condition, the paths from those starts that are driven in all of them."""
    common = set.intersection(*({path.number for path in paths} for paths in conditions))
    return [[path for path in paths if path.number in common] for paths in conditions]


def outcome_table(driven: Conditions) -> str:
    """Return the outcomes of the paths for each noise, mode and kind of starts."""
    rows = []
    for (noise, mode, kind), paths in driven.items():
        if not paths:
            continue
        counts = [sum(path.outcome == outcome for path in paths) for outcome in OUTCOMES]
        errors_m = [path.error_rms_m for path in paths if path.error_rms_m is not None]
        error_in = statistics.fmean(errors_m or [math.nan]) / INCH_M
        rows.append(
            (
                noise,
                mode,
                kind,
                len(paths),
                _goal_share(paths),
                *counts[1:],
                f'{error_in * INCH_M:.4f} m ({error_in:.2f} in)',
            )
        )
    headings = ('noise', 'mode', 'starts', 'paths', 'goal, with 95 % interval')
    return table((*headings, *OUTCOMES[1:], 'position error, mean of rms'), rows)


def mode_table(driven: Conditions) -> str:
    """Return the measures of the paths of each mode, from the same starts with nominal noise."""
    modes = [mode for noise, mode, _ in driven if noise == 'nominal']
    modes = list(dict.fromkeys(modes))
    kinds = list(dict.fromkeys(kind for noise, _, kind in driven if noise == 'nominal'))
    same = [
        from_same_starts([driven.get(('nominal', mode, kind), ()) for mode in modes])
        for kind in kinds
    ]
    rows = []
    for number, mode in enumerate(modes):
        good = to_goal([path for kind in same for path in kind[number]])
        if not good:
            continue
        cells = [
            mean_interval([path.duration_s for path in good]),
            mean_interval([path.turning_deg for path in good]),
            mean_interval([path.length_m for path in good]),
            mean_interval([path.length_m / path.shortest_m for path in good]),
        ]
        steps = sorted(path.step_deg for path in good)
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


def blend_values(found: Mapping[str, Any] | None) -> dict[str, object]:
    """Return the placeholders of the blend study; None where it was not run."""
    names = ('blends', 'deviation_percent', 'worst_place', 'printed_deg', 'unit_deg', 'starts')
    if not found or 'fuzzy-as-printed' not in found:
        return dict.fromkeys(names)
    deviation = found['fuzzy-as-printed']['deviation']
    x_m, y_m = deviation['at_m']
    rows = [
        (
            blend,
            f'{one["jump_deg"]:.1f} deg',
            ', '.join(f'{place_m:.2f} m' for place_m in one['jump_at_m']),
            share(one['goal'], one['starts']),
        )
        for blend, one in found.items()
    ]
    return {
        'blends': table(
            ('blend', 'largest jump across a border', 'at x, y', 'goal reached'), rows
        ),
        'deviation_percent': f'{deviation["percent"]:.1f}',
        'worst_place': f'x = {x_m:.2f} m, y = {y_m:.2f} m '
        f'({x_m / INCH_M:.0f}, {y_m / INCH_M:.0f} in)',
        'printed_deg': f'{deviation["printed_deg"]:.0f}',
        'unit_deg': f'{deviation["unit_deg"]:.0f}',
        'starts': found['fuzzy']['starts'],
    }


def learned_table(without: Sequence[DrivenPath], images: Sequence[DrivenPath]) -> str:
    """Return the measures of policies learned without noise and with images, and differences.

    Args:
        without: Paths of the policies learned without noise.
        images: Paths of the policies learned with images, from the same starts in the same order.
    """
    n, m = len(without), len(images)
    good, seen = len(to_goal(without)), len(to_goal(images))
    change, low, high = difference_of_shares((seen, m), (good, n))
    pairs = [
        (a, b) for a, b in zip(without, images, strict=True) if a.outcome == b.outcome == 'goal'
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
    """Return the outcomes in the example arenas, fuzzy, with nominal noise."""
    return table(
        ('arena', 'paths', 'goal, with 95 % interval', 'largest heading step, deg'),
        (
            (name, len(paths), _goal_share(paths), f'{max(path.step_deg for path in paths):.1f}')
            for name, paths in driven.items()
            if paths
        ),
    )


def parameter_values() -> dict[str, object]:
    """Return the placeholders of the free parameters, and of the machine."""
    values = flatten_config(ControllerConfig())
    texts = {k: f'{v:.6g}' if isinstance(v, float) else str(v) for k, v in values.items()}
    rows = [
        (f'`{name}`', texts[name], info.description)
        for name, info in parameter_infos(ControllerConfig).items()
    ]
    return {
        'machine': machine(),
        'parameters': table(('parameter', 'default', 'description'), rows),
        'x_knots': ', '.join(f'{knot_m:.3f}' for knot_m in DEFAULT_X_KNOTS_M),
        'y_knots': ', '.join(f'{knot_m:.3f}' for knot_m in DEFAULT_Y_KNOTS_M),
    }
