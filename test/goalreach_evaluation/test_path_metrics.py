"""Measures of a driven path, on paths computed by hand."""

import math

import pytest

from goalreach_evaluation.path_metrics import PathMeter, error_statistics
from goalreach_msgs_py.values import PathOutcome, Pose2


def pose(x: float, y: float, heading: float = 0.0) -> Pose2:
    return Pose2(x_m=x, y_m=y, heading_rad=heading)


def l_shaped_path() -> PathMeter:
    """Return a meter fed with 3 m along x, a left turn, 4 m along y, a second apart each."""
    meter = PathMeter(pose(0, 0), trace_step=1)
    meter.add(time_ns=10**9, truth=pose(0, 0), estimate=None, commanded_heading_rad=None)
    meter.add(
        time_ns=2 * 10**9, truth=pose(3, 0), estimate=pose(3, 0.3), commanded_heading_rad=0.0
    )
    corner = pose(3, 0, math.pi / 2)
    meter.add(time_ns=3 * 10**9, truth=corner, estimate=corner, commanded_heading_rad=1.5)
    end = pose(3, 4, math.pi / 2)
    meter.add(time_ns=4 * 10**9, truth=end, estimate=end, commanded_heading_rad=1.6)
    return meter


def test_an_l_shaped_path() -> None:
    result = l_shaped_path().finish(PathOutcome.GOAL, in_goal=True)
    assert result.outcome == 'goal'
    assert result.duration_s == pytest.approx(3.0)
    assert result.length_m == pytest.approx(7.0)
    assert result.turning_rad == pytest.approx(math.pi / 2)
    assert result.max_heading_step_rad == pytest.approx(1.5)
    assert result.pose_error_m == pytest.approx(
        {'rms': 0.3 / math.sqrt(3), 'p95': 0.27, 'max': 0.3}
    )
    assert result.heading_error_rad['max'] == 0.0
    assert result.trace == ((0, 0), (3, 0), (3, 0), (3, 4), (3, 4))


@pytest.mark.parametrize(
    ('outcome', 'in_goal', 'judged'),
    [
        (PathOutcome.GOAL, True, 'goal'),
        (PathOutcome.GOAL, False, 'false-goal'),
        (PathOutcome.BUMP, False, 'bump'),
        (PathOutcome.TIMEOUT, True, 'timeout'),
    ],
)
def test_the_truth_judges_a_declared_goal(
    *, outcome: PathOutcome, in_goal: bool, judged: str
) -> None:
    assert l_shaped_path().finish(outcome, in_goal=in_goal).outcome == judged


def test_a_turn_across_180_degrees_is_short() -> None:
    meter = PathMeter(pose(0, 0))
    for index, heading in enumerate((3.1, -3.1)):
        truth = pose(0.5, 0, heading)
        meter.add(time_ns=index, truth=truth, estimate=None, commanded_heading_rad=heading)
    result = meter.finish(PathOutcome.BUMP, in_goal=False)
    assert result.turning_rad == pytest.approx(2 * math.pi - 6.2)
    assert result.max_heading_step_rad == pytest.approx(2 * math.pi - 6.2)


def test_the_first_alignment_does_not_count_as_a_step() -> None:
    meter = PathMeter(pose(1, 1))
    for index, (x_m, heading_rad) in enumerate(
        ((1.0, 0.0), (1.0, 2.0), (1.0005, 2.5), (1.1, 2.6), (1.0, 2.8))
    ):
        truth = pose(x_m, 1, 0.0)
        meter.add(time_ns=index, truth=truth, estimate=None, commanded_heading_rad=heading_rad)
    result = meter.finish(PathOutcome.GOAL, in_goal=True)
    assert result.max_heading_step_rad == pytest.approx(0.2)


def test_no_errors_are_zero() -> None:
    assert error_statistics([]) == {'rms': 0.0, 'p95': 0.0, 'max': 0.0}
