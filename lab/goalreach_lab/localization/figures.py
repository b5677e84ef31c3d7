"""The figures of docs/LOCALIZATION.md."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
import numpy as np

from goalreach_evaluation.figures.arena_axes import (
    BLUE,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    add_legend,
    arena_figure,
    to_inches,
)
from goalreach_evaluation.figures.figure_file import write_figure
from goalreach_msgs_py.arena import Arena

_SIZE = (7.0, 4.0)
_NOISE_PX = '0.3'
_BINS_S = [0.2 * k for k in range(51)]
_PLACE: dict[str, Any] = {'marker': 's', 's': 225, 'linewidths': 0, 'zorder': 2}


def _map(found: Mapping[str, Any], *, ratio: bool, title: str, label: str) -> Figure:
    """Return the arena with the bound at each place, or with the measured error over it."""
    figure, axes = arena_figure(Arena(), f'{title}, {_NOISE_PX} px', borders=False)
    figure.set_size_inches(6.4, 7.0)
    x, y = ([to_inches(metres) for metres in found[name]] for name in ('x_m', 'y_m'))
    cells = found['cells'][_NOISE_PX]
    values = [cell['rms_in'] / cell['bound_in'] if ratio else cell['bound_in'] for cell in cells]
    squares = axes.scatter(x, y, c=values, cmap='viridis', **_PLACE)
    figure.colorbar(squares, ax=axes, shrink=0.6, pad=0.14, label=label)
    add_legend(axes, Arena(), Patch(fc='white', ec=GREY, label='three LEDs not in one image'))
    return figure


def _axes(title: str, x: str, y: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=_SIZE, layout='constrained')
    axes = figure.add_subplot()
    axes.set_title(title, fontsize=11)
    axes.set(xlabel=x, ylabel=y)
    axes.grid(color='#dddddd', linewidth=0.6)
    return figure, axes


def _noise(found: Mapping[str, Any]) -> Figure:
    figure, axes = _axes(
        'Errors while driving', 'scale of all errors, times nominal', 'position, in'
    )
    scales = list(found.values())
    x = [one['scale'] for one in scales]
    right = axes.twinx()
    right.set_ylabel('heading, deg')
    for which, style in (('p95', '-'), ('median', ':')):
        position = [one['position_in'][which] for one in scales]
        heading = [one['heading_deg'][which] for one in scales]
        axes.plot(x, position, style, color=BLUE, marker='o', label=f'position, {which}')
        right.plot(x, heading, style, color=VERMILION, marker='s', label=f'heading, {which}')
    axes.set_ylim(bottom=0.0)
    right.set_ylim(bottom=0.0)
    lines = [*axes.get_lines(), *right.get_lines()]
    axes.legend(lines, [str(line.get_label()) for line in lines], fontsize=8, loc='upper left')
    return figure


def _consistency(found: Mapping[str, Any]) -> Figure:
    figure, axes = _axes(
        'Mean NEES of position and heading, 3 degrees of freedom', 'time, s', 'mean over the runs'
    )
    first = next(iter(found.values()))
    band = first['nees']
    label = f'95 % band of {first["runs"]} runs'
    low, high = band['low'], band['high']
    axes.fill_between(first['time_s'], low, high, color=SKY, alpha=0.3, label=label)
    axes.axhline(3.0, color=GREY, linewidth=0.8)
    for (name, one), color in zip(found.items(), (BLUE, ORANGE), strict=False):
        axes.plot(one['time_s'], one['nees']['mean'], color=color, linewidth=1.2, label=name)
    axes.set_ylim(0.0, 6.0)
    axes.legend(fontsize=8, loc='upper right')
    return figure


def _kidnap(found: Sequence[Mapping[str, float]]) -> Figure:
    times = np.array([one['found_s'] for one in found]).clip(0.0, _BINS_S[-1])
    figure, axes = _axes(
        f'{len(times)} kidnappings',
        f'time to relocalize, s (last bar: {_BINS_S[-2]:.1f} s and more)',
        'kidnappings',
    )
    axes.hist(times, bins=_BINS_S, color=BLUE)
    axes.set_yscale('log')
    return figure


def _long(found: Mapping[str, Any]) -> Figure:
    figure, axes = _axes('A day of driving', 'time, h', 'position error, in')
    for name, key, color, width in (
        ('odometry alone', 'odometry_in', GREY, 0.5),
        ('with images: rms of a minute', 'vision_rms_in', BLUE, 0.7),
    ):
        hours = np.arange(1, len(found[key]) + 1) / 60.0
        axes.plot(hours, found[key], color=color, linewidth=width, label=name)
    axes.set_yscale('log')
    axes.legend(fontsize=8, loc='center right')
    return figure


_BOUND = partial(_map, ratio=False, title='Cramer-Rao bound', label='rms error of position, in')
_ERROR = partial(_map, ratio=True, title='Measured error', label='rms error over the bound')
FIGURES: Final[dict[str, tuple[str, Callable[[Any], Figure]]]] = {
    'localization_bound': ('bound', _BOUND),
    'localization_error': ('bound', _ERROR),
    'localization_noise': ('noise', _noise),
    'localization_consistency': ('consistency', _consistency),
    'localization_kidnap': ('kidnap', _kidnap),
    'localization_day': ('long', _long),
}
"""Part and function of each figure, by the figure's name."""


def draw(found: Mapping[str, Any], folder: Path) -> list[Path]:
    """Draw the figures of the parts that were measured, as SVG and PNG.

    Args:
        found: Findings by part.
        folder: Where the files go; created if missing.

    Returns:
        The files.

    Raises:
        FileFormatError: A file cannot be written.
    """
    files: list[Path] = []
    for name, (part, figure) in FIGURES.items():
        if part in found:
            files += write_figure(figure(found[part]), folder, name)
    return files
