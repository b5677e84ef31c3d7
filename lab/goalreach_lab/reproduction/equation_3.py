"""Where equation (3) as printed goes astray, and where its heading jumps."""

from __future__ import annotations

from collections.abc import Iterator
import math
from typing import Any, Final

import numpy as np

from goalreach_evaluation.starts import random_starts
from goalreach_learning.blending import blend_heading
from goalreach_learning.kinematic_drive import blended_track
from goalreach_learning.policy import Policy
from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.regions import memberships
from goalreach_msgs_py.values import PathOutcome

BLENDS: Final = ('fuzzy', 'fuzzy-eq3', 'fuzzy-as-printed')

_GRID_M = 0.02
_ASIDE_M = 1e-6
_ASTRAY_DEG = 45.0


def study_blends(arena: Arena, policy: Policy, starts: int, seed: int) -> dict[str, Any]:
    """Return the findings on the three blends, without noise.

    Args:
        arena: Where.
        policy: What is blended.
        starts: Random starts that a point is driven from with each.
        seed: Seed of the starts.

    Returns:
        'astray': share of the floor, in percent, where equation (3) as printed points more than
        45 deg from the same weights with unit vectors, the worst difference and where it is.
        For each blend, 'jump': largest jump of the heading across a border between two
        regions, and where; 'goal': how many of the starts reach the goal.
    """
    drawn = random_starts(arena, starts, np.random.default_rng(seed))
    found: dict[str, Any] = {'astray': _astray(arena, policy), 'starts': starts}
    for mode in BLENDS:
        tracks = [
            blended_track(
                arena,
                policy,
                start,
                mode=mode,
                memberships=lambda x_m, y_m: _fuzzy_state(policy, x_m, y_m),
            )
            for start in drawn
        ]
        reached = sum(track.outcome is PathOutcome.GOAL for track in tracks)
        found[mode] = {'jump': _largest_jump(arena, policy, mode), 'goal': reached}
    return found


def _fuzzy_state(
    policy: Policy, x_m: float, y_m: float
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    regions = policy.regions
    return memberships(x_m, regions.x_knots_m), memberships(y_m, regions.y_knots_m)


def _heading(policy: Policy, mode: str, x_m: float, y_m: float) -> float | None:
    return blend_heading(mode, *_fuzzy_state(policy, x_m, y_m), policy)


def _free(length_m: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.arange(BODY_RADIUS_M, length_m - BODY_RADIUS_M, _GRID_M, dtype=np.float64)


def _astray(arena: Arena, policy: Policy) -> dict[str, Any]:
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
    share = sum(one[0] > _ASTRAY_DEG for one in off) / len(off)
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
    return {'deg': worst[0], 'at_m': worst[1]}


def _across_borders(arena: Arena) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    """Yield pairs of points on either side of a border between two regions."""
    regions = arena.regions
    for border_m in regions.x_borders_m[1:3]:
        for y_m in _free(arena.length_m).tolist():
            yield (border_m - _ASIDE_M, y_m), (border_m + _ASIDE_M, y_m)
    for border_m in regions.y_borders_m[1:3]:
        for x_m in _free(arena.width_m).tolist():
            yield (x_m, border_m - _ASIDE_M), (x_m, border_m + _ASIDE_M)
