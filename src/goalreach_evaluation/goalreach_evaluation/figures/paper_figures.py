"""The figures of the paper, each as a function, and all by their file names.

Figures 1, 4 and 5 show the state space, its transition areas and the membership functions; 2, 3, 6
and 7 the optimal actions and paths driven by them.
"""

from collections.abc import Sequence
from itertools import cycle
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
import numpy as np

from goalreach_evaluation.figures.arena_axes import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    add_legend,
    add_metre_axes,
    arena_figure,
    draw_region_names,
    region_centre_in,
    to_inches,
)
from goalreach_evaluation.summary_file import RecordedPath, RecordedRun
from goalreach_learning.kinematic_drive import Track, blended_track, crisp_track
from goalreach_learning.policy import Policy, action_directions
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.regions import memberships

_LINES = ((BLUE, '-'), (VERMILION, '--'), (ORANGE, '-.'))
_SAMPLES = 1001
_ARROW_IN = 26.0
_GOAL = 'goal'


def paper_figures(
    arena: Arena, policy: Policy, run: RecordedRun | None = None, *, origin: str = ''
) -> dict[str, Figure]:
    """Draw figures 1 to 6, and 7 from the paths of a run with images, if there is one.

    The arena is that in which the policy was learned; its origin, a file or a seed, is for the
    captions.

    Returns:
        The figures by file name without suffix, in the paper's order.
    """
    figures = {
        'figure_1_state_space': state_space(arena),
        'figure_2_optimal_actions': optimal_actions(arena, policy),
        'figure_3_crisp_paths': crisp_paths(arena, policy),
        'figure_4_transition_areas': transition_areas(arena),
        'figure_5_membership_functions': membership_functions(arena),
        'figure_6_fuzzy_paths': blended_paths(arena, policy),
    }
    if origin:
        for name, figure in figures.items():
            if name.startswith(('figure_2', 'figure_3', 'figure_6')):
                figure.supxlabel(f'Policy: {origin}', fontsize=8)
    if run is not None:
        figure = path_figure(arena, run.paths, f'Paths with the full sensor chain ({run.mode})')
        figure.supxlabel(f'Driven with images, {run.origin}'.rstrip(', '), fontsize=8)
        figures['figure_7_full_chain_paths'] = figure
    return figures


def state_space(arena: Arena) -> Figure:
    """Return Fig. 1, "State Space": the regions."""
    figure, axes = arena_figure(arena, f'State space: {len([*arena.regions.cells])} regions')
    draw_region_names(axes, arena, size=9)
    add_legend(axes, arena)
    return figure


def transition_areas(arena: Arena) -> Figure:
    """Return Fig. 4, "State Space with transition areas"."""
    figure, axes = arena_figure(arena, 'State space with transition areas')
    width, length = to_inches(arena.width_m), to_inches(arena.length_m)
    x_knots = [to_inches(knot) for knot in arena.regions.x_knots_m[1:-1]]
    y_knots = [to_inches(knot) for knot in arena.regions.y_knots_m[1:-1]]
    style: dict[str, Any] = {'facecolor': SKY, 'alpha': 0.45, 'edgecolor': 'none', 'zorder': 2}
    for low, high in zip(x_knots[::2], x_knots[1::2], strict=True):
        axes.add_patch(Rectangle((low, 0), high - low, length, **style))
    for low, high in zip(y_knots[::2], y_knots[1::2], strict=True):
        axes.add_patch(Rectangle((0, low), width, high - low, **style))
    draw_region_names(axes, arena, size=7.5)
    area = Patch(facecolor=SKY, alpha=0.6, label='transition area')
    add_legend(axes, arena, area)
    return figure


def membership_functions(arena: Arena) -> Figure:
    """Return Fig. 5: the membership functions of X (a) and Y (b)."""
    figure = Figure(figsize=(7.2, 6.0), layout='constrained')
    upper, lower = figure.subplots(2, 1)
    _draw_sets(upper, 'x', arena.regions.x_knots_m, arena.regions.labels[0])
    _draw_sets(lower, 'y', arena.regions.y_knots_m, arena.regions.labels[1])
    upper.set_title('(a) Membership functions of X', fontsize=11)
    lower.set_title('(b) Membership functions of Y', fontsize=11)
    return figure


def _draw_sets(axes: Axes, name: str, knots_m: tuple[float, ...], labels: tuple[str, ...]) -> None:
    values_m = np.linspace(knots_m[0], knots_m[-1], _SAMPLES)
    mu = np.array([memberships(float(value), knots_m) for value in values_m])
    for index, (label, (color, line)) in enumerate(zip(labels, cycle(_LINES), strict=False)):
        axes.plot(values_m / INCH_M, mu[:, index], line, color=color, linewidth=2)
        middle = (knots_m[2 * index] + knots_m[2 * index + 1]) / 2
        axes.text(to_inches(middle), 1.05, label, color=color, ha='center', fontsize=9)
    for knot in knots_m:
        axes.axvline(to_inches(knot), color=GREY, linestyle=':', linewidth=0.9, zorder=0)
    knots_in = [to_inches(knot) for knot in knots_m]
    names = [f'${name}_{index}$\n{knot:.1f}' for index, knot in enumerate(knots_in)]
    axes.set_xticks(knots_in, names)
    axes.set(xlim=(knots_in[0], knots_in[-1]), ylim=(0, 1.18), yticks=[0, 0.5, 1])
    axes.set(xlabel=f'{name} (in)', ylabel='membership')
    add_metre_axes(axes, y_too=False)


def optimal_actions(arena: Arena, policy: Policy) -> Figure:
    """Return Fig. 2, "Optimal actions learned": one arrow per region."""
    figure, axes = arena_figure(arena, 'Optimal actions learned')
    count, ends = policy.regions.actions, policy.regions.ends
    for region in arena.regions.cells:
        action = policy.greedy_action(region)
        x, y = region_centre_in(arena, region)
        if action is None:
            text = ends[region].value if region in ends else 'not learned'
            axes.text(x, y, text, ha='center', va='center', fontsize=11)
            continue
        dx, dy = (_ARROW_IN / 2 * part for part in action_directions(count)[action])
        style = {'arrowstyle': '-|>', 'color': BLUE, 'linewidth': 2.6, 'mutation_scale': 20}
        axes.annotate('', (x + dx, y + dy), (x - dx, y - dy), arrowprops=style)
        axes.text(x, y + 23, f'{360.0 / count * action:g}°', ha='center', fontsize=9)
    add_legend(axes, arena)
    return figure


def crisp_paths(arena: Arena, policy: Policy) -> Figure:
    """Return Fig. 3, "Simulated paths": one optimal action after another, through obstacles."""
    tracks = [crisp_track(arena, policy, start) for start in arena.starts]
    kind = 'crisp, obstacles ignored' if arena.obstacles else 'crisp, kinematic'
    return _kinematic_paths(arena, tracks, f'Paths of the optimal actions ({kind})')


def blended_paths(arena: Arena, policy: Policy) -> Figure:
    """Return Fig. 6, "Simulated paths with the fuzzy regions extension"."""
    tracks = [blended_track(arena, policy, start, mode='fuzzy') for start in arena.starts]
    return _kinematic_paths(arena, tracks, 'Paths of the blended actions (fuzzy, kinematic)')


def _kinematic_paths(arena: Arena, tracks: Sequence[Track], title: str) -> Figure:
    return path_figure(arena, [(t.points_m, t.outcome.value) for t in tracks], title)


def path_figure(arena: Arena, paths: Sequence[RecordedPath], title: str) -> Figure:
    """Return paths with a dot at the start and a mark of the outcome at the end.

    Fig. 7 draws true paths driven with images, localizer and state in the loop.
    """
    figure, axes = arena_figure(arena, title)
    for points_m, outcome in paths:
        points = np.asarray(points_m) / INCH_M
        reached = outcome == _GOAL
        color, line, mark = (BLUE, '-', '.') if reached else (VERMILION, '--', 'X')
        axes.plot(points[:, 0], points[:, 1], line, color=color, linewidth=1.4, zorder=4)
        axes.plot(*points[0], 'o', color=BLACK, ms=4, zorder=5)
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
    add_legend(axes, arena, *handles)
    return figure
