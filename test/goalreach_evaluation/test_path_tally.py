"""Statistics over many paths."""

from dataclasses import replace

import pytest

from goalreach_evaluation.path_metrics import PathResult, PathTally
from goalreach_msgs_py.values import Pose2


def path(outcome: str, duration_s: float, p95_m: float) -> PathResult:
    return PathResult(
        start=Pose2(x_m=1.0, y_m=2.0, heading_rad=0.0),
        outcome=outcome,
        duration_s=duration_s,
        length_m=3.0 * duration_s,
        turning_rad=0.5,
        max_heading_step_rad=0.1,
        pose_error_m={'rms': 0.0, 'p95': p95_m, 'max': 9.0},
        heading_error_rad={'rms': 0.0, 'p95': 0.25 * p95_m, 'max': 9.0},
    )


def test_two_paths() -> None:
    tally = PathTally.of([path('goal', 10.0, 0.02), path('bump', 4.0, 0.04)])
    assert (tally.paths, tally.goals) == (2, 1)
    found = {name: (tally.mean(name), worst) for name, worst in tally.worst.items()}
    assert found == {
        'duration_s': pytest.approx((7.0, 10.0)),
        'length_m': pytest.approx((21.0, 30.0)),
        'turning_rad': pytest.approx((0.5, 0.5)),
        'pose_error_m': pytest.approx((0.03, 0.04)),
        'heading_error_rad': pytest.approx((0.0075, 0.01)),
    }


def test_no_path_has_no_mean() -> None:
    assert PathTally().mean('duration_s') == 0.0


def test_a_path_without_an_error_is_not_in_the_mean_of_errors() -> None:
    lost = replace(path('timeout', 60.0, 0.0), pose_error_m={}, heading_error_rad={})
    tally = PathTally.of([lost, path('goal', 10.0, 0.02)])
    means = [tally.mean(name) for name in ('pose_error_m', 'heading_error_rad', 'duration_s')]
    assert means == pytest.approx([0.02, 0.005, 35.0])


def test_a_path_without_truth_is_not_judged() -> None:
    timeout = replace(path('timeout', 60.0, 0.0), pose_error_m={}, heading_error_rad={})
    assert PathTally.of([timeout]).judged == 0
    assert PathTally.of([timeout, path('goal', 10.0, 0.02)]).judged == 1
