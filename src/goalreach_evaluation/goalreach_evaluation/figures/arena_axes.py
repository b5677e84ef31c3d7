"""Axes of the arena, in inches as in the paper and in metres."""

import math
from typing import Any, Final

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Rectangle
from matplotlib.ticker import MultipleLocator

from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import Region

# The palette of Okabe and Ito, which people with any colour vision can tell apart.
BLACK: Final = '#000000'
ORANGE: Final = '#e69f00'
SKY: Final = '#56b4e9'
GREEN: Final = '#009e73'
BLUE: Final = '#0072b2'
VERMILION: Final = '#d55e00'
GREY: Final = '#6e6e6e'

_SIZE_IN = (5.4, 7.0)
_TICK_IN = 20.0
_TICK_M = 0.5
_TAG: dict[str, Any] = {'color': BLUE, 'linewidth': 5, 'solid_capstyle': 'butt'}
_LED: dict[str, Any] = {
    'marker': 'D', 'color': ORANGE, 'markeredgecolor': BLACK, 'markersize': 6, 'linestyle': '',
}  # fmt: skip
_OBSTACLE: dict[str, Any] = {'facecolor': GREY, 'linewidth': 0}
_GOAL: dict[str, Any] = {'facecolor': GREEN, 'alpha': 0.22, 'linewidth': 0}


def to_inches(length_m: float) -> float:
    """Return a length in inches."""
    return length_m / INCH_M


def arena_figure(arena: Arena, title: str, *, borders: bool = True) -> tuple[Figure, Axes]:
    """Return a figure with walls, regions, goal, LEDs and obstacles of an arena, from above.

    The goal wall (y = 0) is at the bottom; moving obstacles are at the start of their tracks.
    """
    figure = Figure(figsize=_SIZE_IN, layout='constrained')
    axes = figure.add_subplot()
    width, length = to_inches(arena.width_m), to_inches(arena.length_m)
    axes.set_title(title, fontsize=11)
    axes.set(aspect='equal', xlim=(-4, width + 4), ylim=(-8, length + 4))
    axes.set(xlabel='x (in)', ylabel='y (in)')
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(_TICK_IN))
    axes.tick_params(labelsize=8)
    add_metre_axes(axes)
    x_low, y_low, x_high, y_high = map(to_inches, arena.regions.bounds(arena.regions.goal))
    axes.add_patch(Rectangle((x_low, y_low), x_high - x_low, y_high - y_low, **_GOAL))
    walls: dict[str, Any] = {'edgecolor': BLACK, 'linewidth': 2.2, 'zorder': 6}
    axes.add_patch(Rectangle((0, 0), width, length, fill=False, **walls))
    for x, y, _ in arena.landmarks_m:
        axes.plot(to_inches(x), to_inches(y), zorder=7, **_LED)
    for tag in arena.tags:
        ends_in = tag.corners_m[:2, :2] / INCH_M
        axes.plot(*ends_in.T, zorder=7, **_TAG)
        axes.annotate(str(tag.id), ends_in.mean(axis=0), xytext=(6, 6), textcoords='offset points')
    for one in arena.obstacles:
        (x, y), radius = (to_inches(one.x_m), to_inches(one.y_m)), to_inches(one.radius_m)
        length, width = to_inches(one.length_m), to_inches(one.width_m)
        turn: dict[str, Any] = {'angle': math.degrees(one.heading_rad), 'rotation_point': 'center'}
        box = Rectangle((x - length / 2, y - width / 2), length, width, **turn, **_OBSTACLE)
        axes.add_patch(Circle((x, y), radius, **_OBSTACLE) if radius else box)
    if borders:
        _draw_borders(axes, arena)
    return figure, axes


def add_metre_axes(axes: Axes, *, y_too: bool = True) -> None:
    """Add scales in metres at the top and, where y is a length, too, at the right."""
    functions = (lambda value: value * INCH_M, lambda value: value / INCH_M)
    top = axes.secondary_xaxis('top', functions=functions)
    top.set_xlabel('x (m)' if y_too else axes.get_xlabel().replace('(in)', '(m)'))
    top.tick_params(labelsize=8)
    top.xaxis.set_major_locator(MultipleLocator(_TICK_M))
    if y_too:
        right = axes.secondary_yaxis('right', functions=functions)
        right.set_ylabel('y (m)')
        right.tick_params(labelsize=8)
        right.yaxis.set_major_locator(MultipleLocator(_TICK_M))


def add_legend(axes: Axes, arena: Arena, *handles: Artist) -> None:
    """Add a legend below an arena: the labelled artists, the goal region and the landmarks."""
    always: list[Artist] = [Patch(label='goal region', **_GOAL)]
    always += [Line2D([], [], label='LED', **_LED)] if arena.landmarks_m else []
    always += [Line2D([], [], label='tag', **_TAG)] if arena.tags else []
    always += [Patch(label='obstacle', **_OBSTACLE)] if arena.obstacles else []
    place = {'loc': 'upper center', 'bbox_to_anchor': (0.5, -0.085)}
    axes.legend(handles=[*handles, *always], ncols=3, fontsize=8, frameon=False, **place)


def _draw_borders(axes: Axes, arena: Arena) -> None:
    """Draw the borders between the regions as dotted lines, as in the paper."""
    regions = arena.regions
    style: dict[str, Any] = {'color': GREY, 'linewidth': 1.3, 'zorder': 3}
    width, length = to_inches(arena.width_m), to_inches(arena.length_m)
    for x in regions.x_borders_m[1:-1]:
        axes.plot([to_inches(x)] * 2, [0, length], ':', **style)
    for y in regions.y_borders_m[1:-1]:
        axes.plot([0, width], [to_inches(y)] * 2, ':', **style)


def region_centre_in(arena: Arena, region: Region) -> tuple[float, float]:
    """Return the centre of a region, inches."""
    x_low, y_low, x_high, y_high = map(to_inches, arena.regions.bounds(region))
    return (x_low + x_high) / 2, (y_low + y_high) / 2


def draw_region_names(axes: Axes, arena: Arena, *, size: float) -> None:
    """Write the name of every region into it, in a font of `size` points."""
    for region in arena.regions.cells:
        goal = '\ngoal' if region == arena.regions.goal else ''
        text = arena.regions.name(region).replace('/', '\n') + goal
        x, y = region_centre_in(arena, region)
        axes.text(x, y, text, ha='center', va='center', fontsize=size, zorder=5)
