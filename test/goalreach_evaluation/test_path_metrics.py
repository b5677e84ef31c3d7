"""Measures of a driven path, on paths computed by hand."""

import math

import pytest

from goalreach_evaluation.path_metrics import Tick, error_statistics, measure_path
from goalreach_msgs_py.values import PathOutcome, Pose2


def pose(x: float, y: float, heading: float = 0.0) -> Pose2:
    return Pose2(x_m=x, y_m=y, heading_rad=heading)


def tick(
    time_ns: int, truth: Pose2, heading_rad: float | None, estimate: Pose2 | None = None
) -> Tick:
    return Tick(time_ns=time_ns, truth=truth, estimate=estimate, commanded_heading_rad=heading_rad)


CORNER = pose(3, 0, math.pi / 2)
END = pose(3, 4, math.pi / 2)
L_SHAPED = [
    tick(10**9, pose(0, 0), None),
    tick(2 * 10**9, pose(3, 0), 0.0, pose(3, 0.3)),
    tick(3 * 10**9, CORNER, 1.5, CORNER),
    tick(4 * 10**9, END, 1.6, END),
]
"""3 m along x, a left turn, 4 m along y, a second apart each."""


def test_an_l_shaped_path() -> None:
    result = measure_path(pose(0, 0), L_SHAPED, PathOutcome.GOAL, in_goal=True)
    assert result.outcome == 'goal'
    assert result.duration_s == pytest.approx(3.0)
    assert result.length_m == pytest.approx(7.0)
    assert result.turning_rad == pytest.approx(math.pi / 2)
    assert result.max_heading_step_rad == pytest.approx(1.5)
    assert result.pose_error_m == pytest.approx(
        {'rms': 0.3 / math.sqrt(3), 'p95': 0.27, 'max': 0.3}
    )
    assert result.heading_error_rad['max'] == 0.0
    assert result.trace == ((0, 0), (3, 4))


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
    assert measure_path(pose(0, 0), L_SHAPED, outcome, in_goal=in_goal).outcome == judged


def test_a_turn_across_180_degrees_is_short() -> None:
    ticks = [tick(k, pose(0.5, 0, heading), heading) for k, heading in enumerate((3.1, -3.1))]
    result = measure_path(pose(0, 0), ticks, PathOutcome.BUMP, in_goal=False)
    assert result.turning_rad == pytest.approx(2 * math.pi - 6.2)
    assert result.max_heading_step_rad == pytest.approx(2 * math.pi - 6.2)


def test_the_first_alignment_does_not_count_as_a_step() -> None:
    ticks = [
        tick(index, pose(x_m, 1, 0.0), heading_rad)
        for index, (x_m, heading_rad) in enumerate(
            ((1.0, 0.0), (1.0, 2.0), (1.0005, 2.5), (1.1, 2.6), (1.0, 2.8))
        )
    ]
    result = measure_path(pose(1, 1), ticks, PathOutcome.GOAL, in_goal=True)
    assert result.max_heading_step_rad == pytest.approx(0.2)


def test_a_path_without_ticks_is_of_no_length() -> None:
    result = measure_path(pose(1, 1), [], PathOutcome.TIMEOUT, in_goal=False)
    assert (result.duration_s, result.length_m, result.trace) == (0.0, 0.0, ())


def test_a_path_without_a_confident_estimate_has_no_error() -> None:
    assert error_statistics([]) == {}
    ticks = [tick(index, pose(1, 1), None, None) for index in range(3)]
    result = measure_path(pose(1, 1), ticks, PathOutcome.TIMEOUT, in_goal=False)
    assert (result.pose_error_m, result.heading_error_rad) == ({}, {})
