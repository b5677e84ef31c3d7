"""The policy on the floor: the best action of each region as an arrow, Q-values as roses."""

from __future__ import annotations

from functools import lru_cache
import math

from goalreach_bringup.dashboard.svg import arrow, cm
from goalreach_learning.actions import ACTION_HEADINGS_RAD
from goalreach_learning.blending import Vote
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena

__all__ = ['policy_view']

_ARROW_CM = 34.0
_ROSE_CM = 34.0


def policy_view(
    arena: Arena, policy: Policy | None, cast: tuple[Vote, ...]
) -> dict[str, dict[str, str]]:
    """Return arrows and roses.

    Args:
        arena: Where the regions are.
        policy: What is learned, or None.
        cast: The regions that vote now; their arrows are drawn stronger.
    """
    if policy is None:
        return {'cells': {'html': ''}, 'roses': {'html': ''}}
    total = sum(vote.weight for vote in cast)
    share = {vote.region: vote.weight / total for vote in cast} if total > 0 else {}
    parts = []
    for i in range(3):
        for j in range(3):
            action = policy.actions[i][j]
            if action is None:
                continue
            x0, y0, x1, y1 = arena.regions.bounds((i, j))
            x, y = cm((x0 + x1) / 2, (y0 + y1) / 2, arena.length_m)
            angle_rad = ACTION_HEADINGS_RAD[action]
            dx, dy = _ARROW_CM / 2 * math.cos(angle_rad), -_ARROW_CM / 2 * math.sin(angle_rad)
            weight = share.get((i, j), 0.0)
            name = 'arrow votes' if weight else 'arrow'
            style = f' style="stroke-width:{3.5 + 2.5 * weight:.1f}"'
            line = arrow(name, angle_rad, _ARROW_CM, style)
            parts.append(f'<g transform="translate({x - dx:.1f} {y - dy:.1f})">{line}</g>')
    return {'cells': {'html': ''.join(parts)}, 'roses': {'html': _roses(arena, policy)}}


@lru_cache(maxsize=4)
def _roses(arena: Arena, policy: Policy) -> str:
    """Return the Q-values of every region as eight spokes with their figures."""
    scale = max(1e-9, float(abs(policy.q).max()))
    parts = []
    for i in range(3):
        for j in range(3):
            if (i, j) == arena.regions.goal:
                continue
            x0, y0, x1, y1 = arena.regions.bounds((i, j))
            x, y = cm((x0 + x1) / 2, (y0 + y1) / 2, arena.length_m)
            spokes = [f'<g transform="translate({x:.1f} {y:.1f})"><circle r="{_ROSE_CM}"/>']
            for k, value in enumerate(policy.q[i, j].tolist()):
                angle_rad = ACTION_HEADINGS_RAD[k]
                reach = _ROSE_CM * abs(value) / scale
                name = 'plus' if value >= 0 else 'minus'
                end_x, end_y = reach * math.cos(angle_rad), -reach * math.sin(angle_rad)
                spokes.append(f'<line class="{name}" x2="{end_x:.1f}" y2="{end_y:.1f}"/>')
                label_x, label_y = 48 * math.cos(angle_rad), -45 * math.sin(angle_rad) + 3
                spokes.append(f'<text x="{label_x:.1f}" y="{label_y:.1f}">{value:.2f}</text>')
            parts.append(''.join(spokes) + '</g>')
    return ''.join(parts)
