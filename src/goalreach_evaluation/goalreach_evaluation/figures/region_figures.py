"""Figures 1, 4 and 5: the state space, its transition areas and the membership functions."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
import numpy as np

from goalreach_evaluation.figures.arena_axes import (
    BLUE,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    add_legend,
    add_metre_axes,
    arena_figure,
    draw_borders,
    draw_region_names,
    to_inches,
)
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS, memberships

_LINES = ((BLUE, '-'), (VERMILION, '--'), (ORANGE, '-.'))
_SAMPLES = 1001


def state_space(arena: Arena) -> Figure:
    """Return Fig. 1, "State Space": the nine regions."""
    figure, axes = arena_figure(arena, 'State space: nine regions')
    draw_borders(axes, arena)
    draw_region_names(axes, arena, size=9)
    add_legend(axes)
    return figure


def transition_areas(arena: Arena) -> Figure:
    """Return Fig. 4, "State Space with transition areas"."""
    figure, axes = arena_figure(arena, 'State space with transition areas')
    width, length = to_inches(arena.width_m), to_inches(arena.length_m)
    regions = arena.regions
    for low in (1, 3):
        x_low, x_high = (to_inches(k) for k in regions.x_knots_m[low : low + 2])
        y_low, y_high = (to_inches(k) for k in regions.y_knots_m[low : low + 2])
        style: dict[str, Any] = {'facecolor': SKY, 'alpha': 0.45, 'edgecolor': 'none', 'zorder': 2}
        axes.add_patch(Rectangle((x_low, 0), x_high - x_low, length, **style))
        axes.add_patch(Rectangle((0, y_low), width, y_high - y_low, **style))
    draw_borders(axes, arena)
    draw_region_names(axes, arena, size=7.5)
    area = Patch(facecolor=SKY, alpha=0.6, label='transition area')
    add_legend(axes, area)
    return figure


def membership_functions(arena: Arena) -> Figure:
    """Return Fig. 5: the membership functions of X (a) and Y (b)."""
    figure = Figure(figsize=(7.2, 6.0), layout='constrained')
    upper, lower = figure.subplots(2, 1)
    _draw_sets(upper, 'x', arena.regions.x_knots_m, X_LABELS)
    _draw_sets(lower, 'y', arena.regions.y_knots_m, Y_LABELS)
    upper.set_title('(a) Membership functions of X', fontsize=11)
    lower.set_title('(b) Membership functions of Y', fontsize=11)
    return figure


def _draw_sets(axes: Axes, name: str, knots_m: tuple[float, ...], labels: tuple[str, ...]) -> None:
    values_m = np.linspace(knots_m[0], knots_m[-1], _SAMPLES)
    mu = np.array([memberships(float(value), knots_m) for value in values_m])
    for index, (label, (color, line)) in enumerate(zip(labels, _LINES, strict=True)):
        axes.plot(values_m / INCH_M, mu[:, index], line, color=color, linewidth=2)
        middle = (knots_m[2 * index] + knots_m[2 * index + 1]) / 2
        axes.text(to_inches(middle), 1.05, label, color=color, ha='center', fontsize=9)
    for knot in knots_m:
        axes.axvline(to_inches(knot), color=GREY, linestyle=':', linewidth=0.9, zorder=0)
    knots_in = [to_inches(knot) for knot in knots_m]
    names = [f'${name}_{index}$\n{knot:.1f}' for index, knot in enumerate(knots_in)]
    axes.set_xticks(knots_in, names)
    axes.set_xlabel(f'{name} (in)')
    axes.set_ylabel('membership')
    axes.set_yticks([0, 0.5, 1])
    axes.set_ylim(0, 1.18)
    axes.set_xlim(to_inches(knots_m[0]), to_inches(knots_m[-1]))
    add_metre_axes(axes, y_too=False)
