"""Figures of a run from its bag."""

from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
import numpy as np

from goalreach_bags.run_series import Floats, RunSeries
from goalreach_evaluation.figures.arena_axes import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    add_legend,
    arena_figure,
    to_inches,
)
from goalreach_msgs_py.angles import INCH_M

_JUMP_M: Final = 0.1
"""Longer steps of the truth are placements, not driving. Chosen: ten times a step."""

_COLOURS: Final = (BLUE, ORANGE, GREEN, VERMILION, SKY, BLACK, GREY, '#cc79a7')
_DEGREES: Final = 180.0 / np.pi
_SIZE_IN: Final = (8.0, 6.0)


def run_figures(series: RunSeries) -> dict[str, Figure]:
    """Return the figures of a run by file name."""
    return {
        'path': _path(series),
        'error': _error(series),
        'memberships': _memberships(series),
        'headings': _headings(series),
        'q_values': _q_values(series),
    }


def _broken(series: RunSeries, values: Floats) -> Floats:
    """Return values with a gap at each placement of the robot."""
    steps = np.hypot(*np.diff(series.truth[:, :2], axis=0).T)
    broken: Floats = values.astype(np.float64).copy()
    broken[1:][steps > _JUMP_M] = np.nan
    return broken


def _path(series: RunSeries) -> Figure:
    figure, axes = arena_figure(series.arena, 'Path driven')
    for values, colour, style in ((series.truth, BLUE, '-'), (series.estimate, VERMILION, '--')):
        x, y = (_broken(series, values[:, k] / INCH_M) for k in (0, 1))
        axes.plot(x, y, style, color=colour, linewidth=1.3, zorder=5)
    start = series.truth[0]
    axes.plot(to_inches(start[0]), to_inches(start[1]), 'o', color=BLUE, zorder=6)
    add_legend(
        axes,
        Line2D([], [], color=BLUE, label='truth'),
        Line2D([], [], color=VERMILION, linestyle='--', label='estimate'),
    )
    return figure


def _rows(series: RunSeries, title: str, count: int) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=_SIZE_IN, layout='constrained')
    axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    figure.suptitle(title, fontsize=11)
    axes[-1].set_xlabel('time (s)')
    for one in axes:
        one.set_xlim(series.time_s[0], max(series.time_s[-1], series.time_s[0] + 1e-3))
        one.tick_params(labelsize=8)
        one.grid(color=GREY, alpha=0.25)
    return figure, list(axes)


def _error(series: RunSeries) -> Figure:
    figure, axes = _rows(series, 'Error of the estimate; band: two standard deviations', 3)
    error = series.estimate - series.truth
    error[:, 2] = np.arctan2(np.sin(error[:, 2]), np.cos(error[:, 2]))
    labels = (('x (in)', 1 / INCH_M), ('y (in)', 1 / INCH_M), ('heading (deg)', _DEGREES))
    for k, (label, factor) in enumerate(labels):
        band = 2.0 * series.sigma[:, k] * factor
        axes[k].fill_between(series.time_s, -band, band, color=SKY, alpha=0.35, linewidth=0)
        axes[k].plot(series.time_s, error[:, k] * factor, color=BLUE, linewidth=1.0)
        axes[k].set_ylabel(label)
        largest = np.nan_to_num(np.stack([band, np.abs(error[:, k]) * factor])).max(axis=1)
        limit = 1.2 * float(max(np.nan_to_num(np.nanpercentile(band, 95)), largest[1])) or 1.0
        axes[k].set_ylim(-limit, limit)
    return figure


def _memberships(series: RunSeries) -> Figure:
    figure, axes = _rows(series, 'Memberships', 2)
    columns, rows = series.arena.regions.labels
    for axis, labels, first in ((axes[0], columns, 0), (axes[1], rows, len(columns))):
        for k, label in enumerate(labels):
            axis.plot(series.time_s, series.memberships[:, first + k], label=label)
        axis.set_ylabel('membership')
        axis.legend(fontsize=8, frameon=False, loc='center left', bbox_to_anchor=(1.0, 0.5))
    return figure


def _headings(series: RunSeries) -> Figure:
    figure, axes = _rows(series, 'Headings and commands', 3)
    truth, estimate = (series.truth, BLUE, 'truth'), (series.estimate, VERMILION, 'estimate')
    for values, colour, label in (truth, estimate):
        heading_deg = values[:, 2] % (2 * np.pi) * _DEGREES
        axes[0].plot(series.time_s, heading_deg, '.', color=colour, markersize=2, label=label)
    axes[0].set_ylabel('heading (deg)')
    axes[0].legend(fontsize=8, frameon=False)
    axes[1].plot(series.time_s, series.command[:, 1] * _DEGREES, color=BLACK, linewidth=1.0)
    axes[1].set_ylabel('steering (deg/s)')
    axes[2].plot(series.time_s, series.command[:, 0] / INCH_M, color=BLACK, linewidth=1.0)
    axes[2].set_ylabel('speed (in/s)')
    return figure


def _q_values(series: RunSeries) -> Figure:
    figure, axes = _rows(series, 'Q-values of the region the robot is in', 1)
    for action in range(series.q.shape[1]):
        colour = _COLOURS[action % len(_COLOURS)]
        label = f'{action * 360 / series.q.shape[1]:g} deg'
        axes[0].step(series.time_s, series.q[:, action], color=colour, label=label, linewidth=1.0)
    axes[0].set_ylabel('Q')
    axes[0].legend(
        title='action', fontsize=8, frameon=False, loc='center left', bbox_to_anchor=(1.0, 0.5)
    )
    return figure
