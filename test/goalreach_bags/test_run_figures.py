"""Time series of a run from its bag, and what their figures show, against numbers by hand."""

import math
from pathlib import Path

from matplotlib.figure import Figure
import numpy as np
import pytest

from goalreach_bags.reader import BagReader
from goalreach_bags.run_figures import RunSeries, read_run_series, run_figures
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.diagnostic_messages import q_table_to_raw, state_to_raw
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.pose_messages import estimate_to_raw, odometry_to_raw, twist_to_raw
from goalreach_msgs_py.topics import CMD_VEL, GROUND_TRUTH, POSE, Q_TABLE, STATE
from goalreach_msgs_py.values import Confidence, Odometry, Pose2, PoseEstimate, RegionState, Twist2
from small_bags import string_topic, write_bag

S = 1_000_000_000
TWIST = Twist2(linear_m_per_s=0.3, steering_rad_per_s=-0.2)
TRUTH = ((1.0, 2.0, 0.1), (1.05, 2.0, -0.1), (2.0, 3.0, 3.1))  # carried after the second


def write_run(path: Path, columns: int = 3) -> None:
    """Write a run of three ticks; the second is uncertain, and the third has no command."""
    q = np.arange(24.0 * columns).reshape(columns, 3, 8)
    tables = [np.full_like(q, -1.0), q]
    messages = [(Q_TABLE, 2 * k * S + 1, q_table_to_raw(q)) for k, q in enumerate(tables)]
    found = PoseEstimate(
        pose=Pose2(x_m=0.1, y_m=0.2, heading_rad=0.3), covariance=np.diag([0.01, 0.04, 0.09])
    )
    for tick, (x_m, y_m, heading_rad) in enumerate(TRUTH):
        ns = (tick + 1) * S
        truth = Odometry(pose=Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad), twist=TWIST)
        state = RegionState(
            region=(columns - 1, 1), pose=found.pose,
            mu_x=(0.0, 0.25, 0.75)[-columns:], mu_y=(0.0, 1.0, 0.0),
            goal_probability=0.0, confidence=Confidence.UNCERTAIN if tick == 1 else Confidence.OK,
        )  # fmt: skip
        messages += [
            (GROUND_TRUTH, ns, odometry_to_raw(truth, ns, frame_id='map')),
            (POSE, ns, estimate_to_raw(found, ns)),
            (STATE, ns, state_to_raw(state, ns)),
            *([(CMD_VEL, ns, twist_to_raw(TWIST, ns))] if tick < 2 else []),
        ]
    names = (Q_TABLE, GROUND_TRUTH, POSE, STATE, CMD_VEL)
    write_bag(path, messages, topics=[string_topic(name) for name in names])


def test_each_tick_is_a_row(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    write_run(tmp_path / 'bag')
    with BagReader(tmp_path / 'bag') as bag:
        series = read_run_series(bag)
    assert 'drawn in the arena of the paper' in caplog.text
    assert series.time_s.tolist() == [1.0, 2.0, 3.0]
    assert series.truth == pytest.approx(np.array(TRUTH))
    found = np.array([[0.1, 0.2, 0.3], [math.nan] * 3, [0.1, 0.2, 0.3]])
    for values in (series.estimate, series.sigma):
        assert values == pytest.approx(found, nan_ok=True)
    assert series.memberships[0].tolist() == [0.0, 0.25, 0.75, 0.0, 1.0, 0.0]
    # Region 2, 1 is the eighth of nine; the second table comes just after the second tick.
    assert series.q[:, 0].tolist() == [-1.0, -1.0, 56.0]
    assert series.command[:2].tolist() == [[0.3, -0.2]] * 2
    assert np.isnan(series.command[2]).all()


def test_a_run_in_another_arena_is_not_drawn_in_that_of_the_paper(tmp_path: Path) -> None:
    """A bag of `goalreach record` keeps no parameters, which would tell its arena."""
    write_run(tmp_path / 'bag', columns=2)
    with (
        BagReader(tmp_path / 'bag') as bag,
        pytest.raises(GoalreachError, match=r'rows are \{\(2, 3\)\}, those of the arena \(3, 3\)'),
    ):
        read_run_series(bag)


def line(figure: Figure, axes: int, number: int = 0) -> list[float]:
    return [*map(float, np.asarray(figure.axes[axes].lines[number].get_ydata()))]


def test_figures_show_inches_and_degrees() -> None:
    truth, off = np.array(TRUTH), (0.0254, -0.0508, 0.2)
    series = RunSeries(
        arena=Arena(), time_s=np.array([1.0, 2.0, 3.0]), truth=truth, estimate=truth + off,
        sigma=np.full((3, 3), 0.0254), memberships=np.eye(3, 6), q=np.eye(3, 8),
        command=np.array([[0.254, 0.5]] * 3),
    )  # fmt: skip
    figures = run_figures(series)
    driven = [one for one in figures['path'].axes[0].lines if np.size(one.get_xdata()) == 3]
    for one, off_m in zip(driven, (0.0, 0.0254), strict=True):
        x_in = np.array([1.0 + off_m, 1.05 + off_m, math.nan]) / INCH_M
        assert np.asarray(one.get_xdata()) == pytest.approx(x_in, nan_ok=True)
    for axis, error in enumerate((1.0, -2.0, math.degrees(0.2))):
        assert line(figures['error'], axis) == pytest.approx([error] * 3)
    # The band of two inches is wider than the first error, that of 2.9 degrees is not.
    assert figures['error'].axes[0].get_ylim() == pytest.approx((-2.4, 2.4))
    assert figures['error'].axes[2].get_ylim()[1] == pytest.approx(1.2 * math.degrees(0.2))
    assert line(figures['memberships'], 0, 2) == [0.0, 0.0, 1.0]
    heading_deg = [math.degrees(0.1), 360.0 - math.degrees(0.1), math.degrees(3.1)]
    assert line(figures['headings'], 0) == pytest.approx(heading_deg)
    assert line(figures['headings'], 1) == pytest.approx([math.degrees(0.5)] * 3)
    assert line(figures['headings'], 2) == pytest.approx([10.0] * 3)
    assert line(figures['q_values'], 0, 1) == [0.0, 1.0, 0.0]
    legend = figures['q_values'].axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()][:2] == ['0 deg', '45 deg']
