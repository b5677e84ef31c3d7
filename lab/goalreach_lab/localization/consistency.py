"""Whether an estimator's covariance is honest: NEES and NIS against their chi-square bands.

Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation" (2001),
section 5.4.
"""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.values import FloatArray, Pose2, PoseEstimate


def pose_error(estimate: Pose2, truth: Pose2) -> FloatArray:
    """Return the error (3,) of x, y (m) and heading (rad, wrapped)."""
    turned = angle_difference(estimate.heading_rad, truth.heading_rad)
    return np.array([estimate.x_m - truth.x_m, estimate.y_m - truth.y_m, turned])


def pose_nees(estimate: PoseEstimate, truth: Pose2) -> float:
    """Return the normalized estimation error squared of a pose, 3 degrees of freedom."""
    error = pose_error(estimate.pose, truth)
    return float(error @ np.linalg.solve(estimate.covariance, error))


def chi2_quantile(probability: float, dof: float) -> float:
    """Return a quantile of the chi-square distribution.

    Wilson and Hilferty's cube: from the median up within 2 % for three degrees of freedom; both
    tails within 1 % from 30 degrees of freedom on, as in a mean over runs.

    Args:
        probability: In (0, 1).
        dof: Degrees of freedom, at least one.
    """
    spread = 2.0 / (9.0 * dof)
    cube = 1.0 - spread + NormalDist().inv_cdf(probability) * math.sqrt(spread)
    return dof * max(cube, 0.0) ** 3


def mean_band(dof: int, runs: int, *, probability: float = 0.95) -> tuple[float, float]:
    """Return the band in which the mean over independent runs of an honest NEES or NIS lies.

    Args:
        dof: Degrees of freedom of one value.
        runs: How many independent values the mean is over.
        probability: Of the band, half of the rest on either side.
    """
    outside = 0.5 * (1.0 - probability)
    low = chi2_quantile(outside, dof * runs) / runs
    high = chi2_quantile(1.0 - outside, dof * runs) / runs
    return low, high
