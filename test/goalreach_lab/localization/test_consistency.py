from __future__ import annotations

import math

import numpy as np
import pytest

from goalreach_lab.localization.consistency import chi2_quantile, mean_band, pose_error, pose_nees
from goalreach_msgs_py.values import Pose2, PoseEstimate


def test_errors_wrap_the_heading() -> None:
    first = Pose2(x_m=1.0, y_m=2.0, heading_rad=3.1)
    second = Pose2(x_m=0.5, y_m=2.5, heading_rad=-3.1)
    assert pose_error(first, second) == pytest.approx([0.5, -0.5, 6.2 - math.tau])


def test_nees_by_hand() -> None:
    truth = Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0)
    pose = Pose2(x_m=0.2, y_m=-0.1, heading_rad=0.3)
    estimate = PoseEstimate(pose=pose, covariance=np.diag([0.01, 0.01, 0.09]))
    assert pose_nees(estimate, truth) == pytest.approx(4.0 + 1.0 + 1.0)


@pytest.mark.parametrize(
    ('probability', 'dof', 'expected'),
    [(0.95, 3, 7.815), (0.5, 3, 2.366), (0.999, 3, 16.27), (0.95, 2, 5.991), (0.025, 300, 253.9)],
)
def test_quantiles_as_in_the_tables(probability: float, dof: int, expected: float) -> None:
    assert chi2_quantile(probability, dof) == pytest.approx(expected, rel=0.02)


def test_the_band_of_a_mean_over_runs() -> None:
    low, high = mean_band(3, 100)
    assert (low, high) == pytest.approx((2.539, 3.499), abs=0.01)
