"""Time series of a run, read from its bag, and their figures."""

from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass
import logging
import math
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
import numpy as np
from numpy.typing import NDArray
import yaml

from goalreach_bags.reader import BagReader
from goalreach_bags.recording import PARAMETERS_KEY
from goalreach_evaluation.figures import arena_axes as drawing
from goalreach_evaluation.figures.arena_axes import BLACK, BLUE, GREY, SKY, VERMILION
from goalreach_msgs_py import topics
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.diagnostic_messages import q_table_from_raw, state_from_raw
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.files import load_yaml
from goalreach_msgs_py.pose_messages import estimate_from_raw, odometry_from_raw, twist_from_raw
from goalreach_msgs_py.values import Confidence, FloatArray, Twist2

_READERS: Final[Mapping[str, Callable[[bytes], Any]]] = {
    topics.GROUND_TRUTH: odometry_from_raw,
    topics.POSE: estimate_from_raw,
    topics.STATE: state_from_raw,
    topics.CMD_VEL: twist_from_raw,
    topics.Q_TABLE: q_table_from_raw,
}
_LOG: Final = logging.getLogger(__name__)
_NO_COMMAND: Final = Twist2(linear_m_per_s=math.nan, steering_rad_per_s=math.nan)
_JUMP_M: Final = 0.1
"""Longer steps of the truth are placements, not driving. Chosen: ten times a step."""
_COLOURS: Final = (BLUE, drawing.ORANGE, drawing.GREEN, VERMILION, SKY, BLACK, GREY, '#cc79a7')
_DEGREES: Final = 180.0 / np.pi
_LEGEND: Final[dict[str, Any]] = {'fontsize': 8, 'frameon': False}
_BESIDE: Final = _LEGEND | {'loc': 'center left', 'bbox_to_anchor': (1.0, 0.5)}


@dataclass(frozen=True, kw_only=True)
class RunSeries:
    """Time series of a run; one row per stamp with pose, state and, if recorded, truth.

    Attributes:
        arena: The arena.
        time_s: The stamps, (n).
        truth: True x, y, heading, m and rad, (n, 3); NaN where the bag has none.
        estimate: Estimated x, y, heading, (n, 3); NaN where the state was uncertain.
        sigma: Standard deviations of the estimate, (n, 3); NaN likewise.
        memberships: Of LEFT-SIDE, FRONT, RIGHT-SIDE, NEAR, MEDIUM, FAR, (n, 6).
        q: Q-values of the region's actions, (n, 8); NaN where the bag has no Q-table.
        command: Speed and steering rate commanded, (n, 2); NaN where there is none.
    """

    arena: Arena
    time_s: FloatArray
    truth: FloatArray
    estimate: FloatArray
    sigma: FloatArray
    memberships: FloatArray
    q: FloatArray
    command: FloatArray


def read_run_series(bag: BagReader) -> RunSeries:
    """Return the time series of a run.

    Raises:
        GoalreachError: The bag lacks pose or state, or a message or the arena is another.
    """
    needed = [topics.POSE, topics.STATE]
    bag.require(needed)
    needed += [topics.GROUND_TRUTH] * bool(bag.counts.get(topics.GROUND_TRUTH))
    by_topic: dict[str, dict[int, Any]] = {name: {} for name in _READERS}
    for message in bag.messages(_READERS):
        latched = message.topic == topics.Q_TABLE
        try:
            stamp_ns = message.time_ns if latched else stamp_of(message.data)
            by_topic[message.topic][stamp_ns] = _READERS[message.topic](message.data)
        except MessageError as error:
            raise GoalreachError(f'{bag.path}: {message.topic}: {error}') from None
    stamps = sorted(set.intersection(*(set(by_topic[name]) for name in needed)))
    if not stamps:
        raise GoalreachError(f'{bag.path}: truth, pose and state have no stamp in common')
    estimates = [by_topic[topics.POSE][s] for s in stamps]
    states = [by_topic[topics.STATE][s] for s in stamps]
    tables = by_topic[topics.Q_TABLE]
    shapes = {(len(s.mu_x), len(s.mu_y)) for s in states} | {q.shape[:2] for q in tables.values()}
    doubt = np.array([[state.confidence is not Confidence.OK] for state in states])
    region = np.array([s.region[0] * len(s.mu_y) + s.region[1] for s in states])
    truths = by_topic[topics.GROUND_TRUTH]
    twists = [by_topic[topics.CMD_VEL].get(s, _NO_COMMAND) for s in stamps]
    return RunSeries(
        arena=_recorded_arena(bag, shapes),
        time_s=np.array(stamps) * 1e-9,
        truth=np.array([astuple(truths[s].pose) if truths else [np.nan] * 3 for s in stamps]),
        estimate=np.where(doubt, np.nan, [astuple(estimate.pose) for estimate in estimates]),
        sigma=np.where(doubt, np.nan, np.sqrt([one.covariance.diagonal() for one in estimates])),
        memberships=np.array([(*state.mu_x, *state.mu_y) for state in states]),
        q=_q_over_time(tables, stamps, region),
        command=np.array([astuple(twist) for twist in twists]),
    )


def _recorded_arena(bag: BagReader, shapes: set[tuple[int, ...]]) -> Arena:
    """Return the arena of the run's parameters, the paper's where the bag has none."""
    try:
        parameters = load_yaml(bag.metadata.custom[PARAMETERS_KEY])
        arena = Arena.from_parameters(parameters['nomad200']['ros__parameters'])
    except (KeyError, TypeError, yaml.YAMLError, GoalreachError):
        _LOG.warning('%s: no parameters of a run: drawn in the arena of the paper', bag.path)
        arena = Arena()
    if shapes != {own := arena.regions.shape}:
        text = f'columns and rows are {shapes}, those of the arena {own}'
        raise GoalreachError(f'{bag.path}: {text}')
    return arena


def _q_over_time(
    tables: Mapping[int, FloatArray], stamps: list[int], region: NDArray[np.int64]
) -> FloatArray:
    """Return the Q-values of the region, from the table valid at each stamp."""
    if not tables:
        return np.full((len(stamps), 8), np.nan)
    times = sorted(tables)
    q = np.array([tables[t].reshape(-1, tables[t].shape[-1]) for t in times])
    valid = np.maximum(np.searchsorted(times, stamps, side='right') - 1, 0)
    return np.asarray(q[valid, region], dtype=np.float64)


def run_figures(series: RunSeries) -> dict[str, Figure]:
    """Return the figures of a run by file name."""
    return {
        'path': _path(series),
        'error': _error(series),
        'memberships': _memberships(series),
        'headings': _headings(series),
        'q_values': _q_values(series),
    }


def _path(series: RunSeries) -> Figure:
    figure, axes = drawing.arena_figure(series.arena, 'Path driven')
    placed = np.hypot(*np.diff(series.truth[:, :2], axis=0).T) > _JUMP_M
    lines = []
    for values, colour, style, label in (
        (series.truth, BLUE, '-', 'truth'),
        (series.estimate, VERMILION, '--', 'estimate'),
    ):
        x, y = values[:, :2].T / INCH_M
        x[1:][placed] = np.nan  # a gap
        axes.plot(x, y, style, color=colour, linewidth=1.3, zorder=5)
        lines.append(Line2D([], [], color=colour, linestyle=style, label=label))
    axes.plot(*series.truth[0, :2] / INCH_M, 'o', color=BLUE, zorder=6)
    drawing.add_legend(axes, series.arena, *lines)
    return figure


def _rows(series: RunSeries, title: str, count: int) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(8.0, 6.0), layout='constrained')
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
        axis.legend(**_BESIDE)
    return figure


def _headings(series: RunSeries) -> Figure:
    figure, axes = _rows(series, 'Headings and commands', 3)
    truth, estimate = (series.truth, BLUE, 'truth'), (series.estimate, VERMILION, 'estimate')
    for values, colour, label in (truth, estimate):
        heading_deg = values[:, 2] % (2 * np.pi) * _DEGREES
        axes[0].plot(series.time_s, heading_deg, '.', color=colour, markersize=2, label=label)
    axes[0].set_ylabel('heading (deg)')
    axes[0].legend(**_LEGEND)
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
    axes[0].legend(title='action', **_BESIDE)
    return figure
