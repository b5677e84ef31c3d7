"""The blends of headings without noise: deviation of equation (3) as printed, and jumps."""

from collections.abc import Iterator
import functools
import math
from typing import Any, Final

import numpy as np

from goalreach_evaluation.choices import choose_policy
from goalreach_evaluation.starts import RunSeeds, random_starts
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_learning.blending import blend_heading
from goalreach_learning.kinematic_drive import blended_track
from goalreach_learning.policy import Policy
from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.values import PathOutcome

BLENDS: Final = ('fuzzy', 'fuzzy-eq3', 'fuzzy-as-printed')

_GRID_M = 0.02
_ASIDE_M = 1e-6
_DEVIATION_DEG = 45.0


def blend_study(*, starts: int, seed: int, jobs: int) -> Study:
    """Return the study of the three blends without noise.

    The findings of each blend are 'jump_deg' and 'jump_at_m', the largest jump of the heading
    across a border between two regions, and 'goal', the number of starts from which a point
    reaches the goal. Those of 'fuzzy-as-printed' include 'deviation', see `_deviation`.

    Args:
        starts: Random starts of each blend.
        seed: Seed of learning and starts.
        jobs: Number of processes.
    """
    return Study(
        name='blends',
        key=('blend', 'starts'),
        settings={'seed': seed},
        cases=[{'blend': blend, 'starts': starts} for blend in BLENDS],
        measure=per_case(functools.partial(_measure, seed=seed), jobs=jobs),
        analyse=lambda results: {result['blend']: result for result in results},
    )


def _measure(case: Case, *, seed: int) -> Result:
    blend, seeds, arena = case['blend'], RunSeeds.spawn(seed), Arena()
    policy = choose_policy(None, arena, seeds.training)
    starts = random_starts(arena, case['starts'], np.random.default_rng(seeds.starts))
    tracks = (blended_track(arena, policy, start, mode=blend) for start in starts)
    return {
        **_largest_jump(arena, policy, blend),
        'goal': sum(track.outcome is PathOutcome.GOAL for track in tracks),
        'deviation': _deviation(arena, policy) if blend == 'fuzzy-as-printed' else None,
    }


def _heading(policy: Policy, mode: str, x_m: float, y_m: float) -> float | None:
    return blend_heading(mode, *policy.regions.memberships_at(x_m, y_m), policy)


def _free(length_m: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.arange(BODY_RADIUS_M, length_m - BODY_RADIUS_M, _GRID_M, dtype=np.float64)


def _deviation(arena: Arena, policy: Policy) -> dict[str, Any]:
    """Return how equation (3) as printed deviates from the same weights with unit vectors.

    Returns:
        'percent': share of the free floor outside the goal where it deviates by more than 45 deg;
        'worst_deg' and 'at_m': largest deviation and its place; 'printed_deg', 'unit_deg': the
        two headings there.
    """
    off: list[tuple[float, float, float]] = []
    for x_m in _free(arena.width_m).tolist():
        for y_m in _free(arena.length_m).tolist():
            if arena.regions.region_at(x_m, y_m) == arena.regions.goal:
                continue
            printed = _heading(policy, 'fuzzy-as-printed', x_m, y_m)
            unit = _heading(policy, 'fuzzy-eq3', x_m, y_m)
            if printed is not None and unit is not None:
                off.append((abs(math.degrees(angle_difference(printed, unit))), x_m, y_m))
    worst_deg, x_m, y_m = max(off)
    share = sum(one[0] > _DEVIATION_DEG for one in off) / len(off)
    printed, unit = (
        _heading(policy, mode, x_m, y_m) or 0.0 for mode in ('fuzzy-as-printed', 'fuzzy-eq3')
    )
    return {
        'percent': 100.0 * share,
        'worst_deg': worst_deg,
        'at_m': [round(x_m, 3), round(y_m, 3)],
        'printed_deg': math.degrees(printed) % 360.0,
        'unit_deg': math.degrees(unit) % 360.0,
    }


def _largest_jump(arena: Arena, policy: Policy, mode: str) -> dict[str, Any]:
    worst: tuple[float, list[float]] = (0.0, [])
    for near, far in _across_borders(arena):
        before, after = _heading(policy, mode, *near), _heading(policy, mode, *far)
        if before is not None and after is not None:
            jump_deg = abs(math.degrees(angle_difference(after, before)))
            worst = max(worst, (jump_deg, [round(near[0], 3), round(near[1], 3)]))
    return {'jump_deg': worst[0], 'jump_at_m': worst[1]}


def _across_borders(arena: Arena) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    """Yield pairs of points on either side of a border between two regions."""
    regions = arena.regions
    for border_m in regions.x_borders_m[1:3]:
        for y_m in _free(arena.length_m).tolist():
            yield (border_m - _ASIDE_M, y_m), (border_m + _ASIDE_M, y_m)
    for border_m in regions.y_borders_m[1:3]:
        for x_m in _free(arena.width_m).tolist():
            yield (x_m, border_m - _ASIDE_M), (x_m, border_m + _ASIDE_M)
