"""Figures 2, 3, 6 and 7: optimal actions, and paths driven by them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
import numpy as np

from goalreach_evaluation.figures.arena_axes import (
    BLACK,
    BLUE,
    VERMILION,
    add_legend,
    arena_figure,
    draw_borders,
    region_centre_in,
)
from goalreach_evaluation.summary_file import RecordedPath
from goalreach_learning.kinematic_drive import Track, blended_track, crisp_track
from goalreach_learning.policy import Policy
from goalreach_learning.task import ACTION_DIRECTIONS, ACTIONS_DEG
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.regions import memberships
from goalreach_msgs_py.values import FloatArray, Pose2

_ARROW_IN = 26.0
_GOAL = 'goal'


def optimal_actions(arena: Arena, policy: Policy) -> Figure:
    """Return Fig. 2, "Optimal actions learned": one arrow per region."""
    figure, axes = arena_figure(arena, 'Optimal actions learned')
    draw_borders(axes, arena)
    for i in range(3):
        for j in range(3):
            action = policy.greedy_action((i, j))
            x, y = region_centre_in(arena, (i, j))
            if action is None:
                text = _GOAL if (i, j) == policy.regions.goal else 'not learned'
                axes.text(x, y, text, ha='center', va='center', fontsize=11)
                continue
            dx, dy = (_ARROW_IN / 2 * part for part in ACTION_DIRECTIONS[action])
            style = {'arrowstyle': '-|>', 'color': BLUE, 'linewidth': 2.6, 'mutation_scale': 20}
            axes.annotate('', (x + dx, y + dy), (x - dx, y - dy), arrowprops=style)
            axes.text(x, y + 23, f'{ACTIONS_DEG[action]:.0f}°', ha='center', fontsize=9)
    add_legend(axes)
    return figure


def crisp_paths(arena: Arena, policy: Policy) -> Figure:
    """Return Fig. 3, "Simulated paths": one optimal action after another."""
    figure, axes = arena_figure(arena, 'Paths of the optimal actions (crisp, kinematic)')
    draw_borders(axes, arena)
    tracks = [crisp_track(arena, policy, start) for start in arena.starts]
    _draw_paths(axes, [(t.points_m, t.outcome.value) for t in tracks])
    return figure


def blended_paths(arena: Arena, policy: Policy, mode: str = 'fuzzy') -> Figure:
    """Return Fig. 6, "Simulated paths with the fuzzy regions extension"."""
    figure, axes = arena_figure(arena, f'Paths of the blended actions ({mode}, kinematic)')
    draw_borders(axes, arena)

    tracks = [_blended(arena, policy, start, mode) for start in arena.starts]
    _draw_paths(axes, [(t.points_m, t.outcome.value) for t in tracks])
    return figure


def course_tracks(arena: Arena, policy: Policy) -> dict[str, Track]:
    """Return the fuzzy and the crisp track from the start whose fuzzy track is longest."""
    tracks = {start: _blended(arena, policy, start, 'fuzzy') for start in arena.starts}
    start, longest = max(tracks.items(), key=lambda item: item[1].length_m)
    return {'fuzzy': longest, 'crisp': crisp_track(arena, policy, start)}


def _blended(arena: Arena, policy: Policy, start: Pose2, mode: str) -> Track:
    regions = policy.regions

    def fuzzy_state(x_m: float, y_m: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        return memberships(x_m, regions.x_knots_m), memberships(y_m, regions.y_knots_m)

    return blended_track(arena, policy, start, mode=mode, memberships=fuzzy_state)


def recorded_paths(arena: Arena, paths: Sequence[RecordedPath], mode: str) -> Figure:
    """Return Fig. 7: true paths driven with images, localizer and state in the loop.

    Args:
        arena: The arena.
        paths: Paths of a recorded run.
        mode: How the heading was chosen.
    """
    figure, axes = arena_figure(arena, f'Paths with the full sensor chain ({mode})')
    draw_borders(axes, arena)
    _draw_paths(axes, [(path.points_m, path.outcome) for path in paths])
    return figure


def _draw_paths(axes: Axes, paths: Sequence[tuple[FloatArray, str]]) -> None:
    """Draw paths with a dot at the start and a mark of the outcome at the end."""
    for points_m, outcome in paths:
        points = np.asarray(points_m) / INCH_M
        reached = outcome == _GOAL
        color = BLUE if reached else VERMILION
        line = '-' if reached else '--'
        axes.plot(points[:, 0], points[:, 1], line, color=color, linewidth=1.4, zorder=4)
        axes.plot(*points[0], 'o', color=BLACK, ms=4, zorder=5)
        mark = '.' if reached else 'X'
        axes.plot(*points[-1], mark, color=color, ms=7, zorder=5)
    goals = sum(outcome == _GOAL for _, outcome in paths)
    goal = f'goal reached: {goals} of {len(paths)}'
    handles = [
        Line2D([], [], color=BLACK, marker='o', ms=4, linestyle='', label='start'),
        Line2D([], [], color=BLUE, marker='.', ms=7, label=goal),
    ]
    if goals < len(paths):
        failed: dict[str, Any] = {'color': VERMILION, 'marker': 'X', 'linestyle': '--'}
        handles.append(Line2D([], [], label='goal not reached', **failed))
    add_legend(axes, *handles)
