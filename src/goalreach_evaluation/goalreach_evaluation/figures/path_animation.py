"""Paths as a short animation: the robot's body and its trail over the regions."""

from collections.abc import Mapping
from typing import Any, Final

from matplotlib.animation import FuncAnimation
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
import numpy as np

from goalreach_evaluation.figures.arena_axes import (
    BLACK,
    BLUE,
    VERMILION,
    add_legend,
    arena_figure,
    draw_region_names,
    to_inches,
)
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import BODY_RADIUS_M, Arena
from goalreach_msgs_py.values import FloatArray

FRAMES_PER_S: Final = 12
_FRAMES: Final = 48
_HELD: Final = 12
"""Frames that show the end before the loop starts again: one second."""
_STYLES: Final[tuple[dict[str, Any], ...]] = (
    {'color': BLUE, 'linestyle': '-'},
    {'color': VERMILION, 'linestyle': '--'},
)


def at_constant_speed(points_m: FloatArray, longest_m: float, frames: int) -> FloatArray:
    """Return the positions of a robot of constant speed; it stands once it has arrived.

    Args:
        points_m: The path (n, 2), metres, straight between its points.
        longest_m: Length driven over all frames.
        frames: Number of frames, at least 2.

    Returns:
        Positions (frames, 2), metres.
    """
    steps_m = np.hypot(*np.diff(points_m, axis=0).T)
    along_m = np.concatenate([[0.0], np.cumsum(steps_m)])
    driven_m = np.minimum(np.linspace(0.0, longest_m, frames), along_m[-1])
    columns = [np.interp(driven_m, along_m, points_m[:, k]) for k in (0, 1)]
    return np.stack(columns, axis=1)


def animate(arena: Arena, courses: Mapping[str, FloatArray], title: str) -> FuncAnimation:
    """Return the animation of up to two paths driven at the same speed.

    Args:
        arena: The arena.
        courses: The paths by their names in the legend: positions (n, 2) in `map`, metres.
        title: Title.
    """
    figure, axes = arena_figure(arena, title)
    draw_region_names(axes, arena, size=7)
    paths_m = courses.values()
    longest_m = max(float(np.hypot(*np.diff(path_m, axis=0).T).sum()) for path_m in paths_m)
    tracks = [at_constant_speed(path_m, longest_m, _FRAMES) for path_m in paths_m]
    robots = [_Robot(axes, style) for style in _STYLES[: len(courses)]]
    handles = [
        Line2D([], [], label=label, **style)
        for label, style in zip(courses, _STYLES, strict=False)
    ]
    add_legend(axes, *handles)

    figure.draw_without_rendering()
    figure.set_layout_engine('none')  # laid out once: layout costs more than drawing

    def draw(frame: int) -> list[Artist]:
        shown = min(frame, _FRAMES - 1)
        pairs = zip(robots, tracks, strict=True)
        return [artist for robot, track in pairs for artist in robot.go(track[: shown + 1])]

    return FuncAnimation(
        figure, draw, frames=_FRAMES + _HELD, interval=1000 / FRAMES_PER_S, blit=False
    )


class _Robot:
    """The body of the robot and its trail."""

    def __init__(self, axes: Axes, style: dict[str, Any]) -> None:
        (self._trail,) = axes.plot([], [], linewidth=2.0, zorder=4, **style)
        radius = to_inches(BODY_RADIUS_M)
        self._body = Circle((0, 0), radius, facecolor='white', edgecolor=BLACK, zorder=8)
        self._body.set_alpha(0.85)
        (self._nose,) = axes.plot([], [], linewidth=2.5, color=style['color'], zorder=9)
        axes.add_patch(self._body)

    def go(self, track_m: FloatArray) -> tuple[Artist, ...]:
        """Show the path so far, the body at its end."""
        points = track_m / INCH_M
        x, y = points[-1]
        self._trail.set_data(points[:, 0], points[:, 1])
        self._body.set_center((x, y))
        moved = points[-1] - points[max(0, len(points) - 3)]
        length = float(np.hypot(*moved))
        if length > 0.0:
            dx, dy = moved / length * to_inches(BODY_RADIUS_M)
            self._nose.set_data([x, x + dx], [y, y + dy])
        return self._trail, self._body, self._nose
