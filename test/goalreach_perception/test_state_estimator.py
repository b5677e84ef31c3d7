from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from goalreach_msgs_py.angles import inches
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import Confidence, FloatArray, Pose2, PoseEstimate, RegionState
from goalreach_perception.localizer_output import uniform_estimate
from goalreach_perception.state_estimator import (
    StateEstimator,
    StateEstimatorConfig,
    probability_in_rectangle,
)

SMALL = np.diag([1e-4, 1e-4, 1e-4])


def state_at(x_in: float, y_in: float, covariance: FloatArray = SMALL) -> RegionState:
    pose = Pose2(x_m=inches(x_in), y_m=inches(y_in), heading_rad=0.0)
    return StateEstimator(StateEstimatorConfig()).estimate(
        PoseEstimate(pose=pose, covariance=covariance)
    )


def test_the_middle_of_the_goal_region() -> None:
    state = state_at(70.0, 30.0)
    assert state.region == (1, 0)
    assert (state.mu_x, state.mu_y) == ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    assert state.goal_probability == pytest.approx(1.0, abs=1e-6)
    assert state.confidence is Confidence.OK


def test_memberships_are_one_half_on_a_crisp_border() -> None:
    # Knots 36.5 and 56.5 in: their middle is 46.5 in; 41.5 in is a quarter of the way.
    assert state_at(46.5, 30.0).mu_x == pytest.approx((0.5, 0.5, 0.0))
    assert state_at(41.5, 30.0).mu_x == pytest.approx((0.75, 0.25, 0.0))
    assert state_at(46.5, 30.0).goal_probability == pytest.approx(0.5, abs=1e-3)


def test_confidence_follows_position_heading_and_age() -> None:
    assert state_at(70.0, 30.0, np.diag([0.16**2, 1e-4, 1e-4])).confidence is Confidence.UNCERTAIN
    assert state_at(70.0, 30.0, np.diag([1e-4, 1e-4, 0.1**2])).confidence is Confidence.UNCERTAIN
    assert state_at(70.0, 30.0, np.full((3, 3), np.nan)).confidence is Confidence.UNCERTAIN
    estimate = uniform_estimate(3.556, 5.08)
    estimator = StateEstimator(StateEstimatorConfig())
    assert estimator.estimate(estimate).confidence is Confidence.UNCERTAIN
    assert estimator.estimate(estimate, age_s=1.0).confidence is Confidence.STALE
    assert estimator.estimate(estimate, age_s=math.nan).confidence is Confidence.STALE


def test_the_goal_can_be_another_region() -> None:
    estimator = StateEstimator(StateEstimatorConfig(goal='LEFT-SIDE/FAR'))
    pose = Pose2(x_m=0.4, y_m=4.5, heading_rad=0.0)
    assert estimator.estimate(PoseEstimate(pose=pose, covariance=SMALL)).goal_probability > 0.99


@pytest.mark.parametrize(
    ('change', 'field'),
    [
        ({'goal': 'NOWHERE'}, 'region'),
        ({'x_knots_m': (0.0, 2.0, 1.0, 3.0, 4.0, 5.0)}, 'x_knots_m'),
    ],
)
def test_a_bad_configuration_is_refused_by_name(change: dict[str, Any], field: str) -> None:
    with pytest.raises(ConfigurationError) as error:
        StateEstimatorConfig(**change)
    assert error.value.field == field


@pytest.mark.parametrize(
    ('correlation', 'expected'),
    [(0.0, 0.25), (0.5, 1.0 / 3.0), (-0.5, 1.0 / 6.0), (0.9, 0.25 + math.asin(0.9) / math.tau)],
)
def test_probability_of_a_quadrant(correlation: float, expected: float) -> None:
    # Sheppard's formula: 1/4 + asin(rho) / (2 pi).
    covariance = np.array([[1.0, 2.0 * correlation], [2.0 * correlation, 4.0]])
    found = probability_in_rectangle((3.0, -2.0), covariance, (3.0, -2.0, 103.0, 98.0))
    assert found == pytest.approx(expected, abs=1e-5)


def test_probability_within_one_sigma_of_both_axes() -> None:
    # 0.682689492 squared.
    box = (-1.0, -1.0, 1.0, 1.0)
    assert probability_in_rectangle((0.0, 0.0), np.eye(2), box) == pytest.approx(0.46606, abs=1e-5)
    assert probability_in_rectangle((0.0, 0.0), np.ones((2, 2)), box) == pytest.approx(0.682689)
    assert probability_in_rectangle((0.5, 0.5), np.zeros((2, 2)), box) == 1.0
    # From -0.5 to 2 sigma along x, 0.668712, and from -1 to 0.5 sigma along y, 0.532807.
    uneven = probability_in_rectangle((1.0, 2.0), np.diag([4.0, 16.0]), (0.0, -2.0, 5.0, 4.0))
    assert uneven == pytest.approx(0.356295, abs=1e-6)


def test_probability_of_a_point_without_error_on_the_border() -> None:
    box, exact = (1.0, 1.0, 2.0, 2.0), np.zeros((2, 2))
    assert probability_in_rectangle((1.0, 1.0), exact, box) == pytest.approx(0.25)
    assert probability_in_rectangle((1.0, 1.5), exact, box) == pytest.approx(0.5)


def test_probability_is_zero_if_not_finite() -> None:
    box = (-1.0, -1.0, 1.0, 1.0)
    assert probability_in_rectangle((math.nan, 0.0), np.eye(2), box) == 0.0
    assert probability_in_rectangle((0.0, 0.0), np.full((2, 2), np.nan), box) == 0.0
    assert probability_in_rectangle((50.0, 0.0), np.eye(2), box) < 1e-9


@pytest.mark.parametrize(
    ('factor', 'heading_rad', 'age_s', 'confidence'),
    [
        (1.17, 0.0872, 0.5, Confidence.OK),
        (1.18, 0.0872, 0.5, Confidence.UNCERTAIN),  # 2 in along the worst axis: 0.00258 m^2
        (1.17, 0.0873, 0.5, Confidence.UNCERTAIN),
        (1.17, 0.0872, 0.501, Confidence.STALE),
    ],
)
def test_limits_of_confidence(
    factor: float, heading_rad: float, age_s: float, confidence: Confidence
) -> None:
    # The larger variance is 0.0012 + hypot(0.0008, 0.0006) = 0.0022 m^2.
    xx, xy, yy = factor * np.array([0.002, 0.0006, 0.0004])
    covariance = np.array([[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, heading_rad**2]])
    pose = PoseEstimate(pose=Pose2(x_m=1.0, y_m=1.0, heading_rad=0.0), covariance=covariance)
    state = StateEstimator(StateEstimatorConfig()).estimate(pose, age_s=age_s)
    assert state.confidence is confidence


def test_regions_and_goal_are_those_of_the_arena() -> None:
    regions = RegionMap(x_knots_m=(0.0, 1.0, 1.2, 2.0, 2.4, 3.556), goal=(2, 1))
    assert StateEstimatorConfig.for_arena(Arena(regions=regions)).region_map() == regions
