"""The paper's state of a pose with covariance: region, memberships, confidence."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from goalreach_msgs_py.angles import INCH_M, deg
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.regions import (
    DEFAULT_X_KNOTS_M,
    DEFAULT_Y_KNOTS_M,
    GOAL_REGION,
    RegionMap,
    parse_region,
    region_name,
)
from goalreach_msgs_py.values import Confidence, FloatArray, PoseEstimate, RegionState

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)
_REACH_SIGMA = 6.0
_NOTHING = 1e-9
_SQRT2 = math.sqrt(2.0)


@dataclass(frozen=True, kw_only=True)
class StateEstimatorConfig(Configuration):
    """Region borders, goal and thresholds of the confidence."""

    x_knots_m: tuple[float, ...] = parameter(
        DEFAULT_X_KNOTS_M, 'Knots x0 ... x5 of the fuzzy sets over x, m (Fig. 5 a)'
    )
    y_knots_m: tuple[float, ...] = parameter(
        DEFAULT_Y_KNOTS_M, 'Knots y0 ... y5 of the fuzzy sets over y, m (Fig. 5 b)'
    )
    goal: str = parameter(region_name(GOAL_REGION), 'Goal region as X/Y, section "The State Set"')
    max_position_sigma_m: float = parameter(
        2.0 * INCH_M,
        'Position uncertainty along its worst axis above which a pose is UNCERTAIN, m (1 sigma; '
        'chosen: above what nominal noise leads to; an error of 6 in is then one of 3 sigma)',
        within=(0.0, 10.0),
    )
    max_heading_sigma_rad: float = parameter(
        deg(5.0),
        'Heading uncertainty above which a pose is UNCERTAIN, rad (1 sigma; chosen)',
        within=(0.0, math.pi),
    )
    max_age_s: float = parameter(
        0.5, 'Age above which a pose is STALE, s (chosen)', within=(0.0, 60.0)
    )

    def __post_init__(self) -> None:
        """Check every field, and that knots and goal describe regions."""
        super().__post_init__()
        self.region_map()

    @classmethod
    def for_arena(cls, arena: Arena) -> StateEstimatorConfig:
        """Return the configuration for the regions and the goal of an arena."""
        x_knots_m, y_knots_m = arena.regions.x_knots_m, arena.regions.y_knots_m
        goal = region_name(arena.regions.goal, arena.regions.shape)
        return cls(x_knots_m=x_knots_m, y_knots_m=y_knots_m, goal=goal)

    def region_map(self) -> RegionMap:
        """Return the regions of the knots with the goal.

        Raises:
            ConfigurationError: Knots or goal are invalid.
        """
        goal = parse_region(self.goal)
        return RegionMap(x_knots_m=self.x_knots_m, y_knots_m=self.y_knots_m, goal=goal)


class StateEstimator:
    """Computes the state of sections "The State Set" and "The Testing Phase"."""

    def __init__(self, config: StateEstimatorConfig) -> None:
        self._config = config
        self._regions = config.region_map()
        self._goal_bounds_m = self._regions.bounds(self._regions.goal)

    def estimate(self, pose: PoseEstimate, *, age_s: float = 0.0) -> RegionState:
        """Return the state of a pose."""
        x_m, y_m = pose.pose.x_m, pose.pose.y_m
        covariance = pose.covariance
        mu_x, mu_y = self._regions.memberships_at(x_m, y_m)
        return RegionState(
            region=self._regions.region_at(x_m, y_m),
            mu_x=mu_x,
            mu_y=mu_y,
            pose=pose.pose,
            goal_probability=probability_in_rectangle((x_m, y_m), covariance, self._goal_bounds_m),
            confidence=self._confidence(covariance, age_s),
        )

    def _confidence(self, covariance: FloatArray, age_s: float) -> Confidence:
        """Return the confidence of a pose; NaN is uncertain."""
        if not age_s <= self._config.max_age_s:
            return Confidence.STALE
        xx, xy, yy = float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])
        worst = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
        certain = worst <= self._config.max_position_sigma_m**2
        certain &= float(covariance[2, 2]) <= self._config.max_heading_sigma_rad**2
        return Confidence.OK if certain else Confidence.UNCERTAIN


def probability_in_rectangle(
    mean_m: tuple[float, float],
    covariance: FloatArray,
    bounds_m: tuple[float, float, float, float],
) -> float:
    """Return the probability that a point lies in a rectangle: exact for the Gaussian.

    P = integral over x of p(x) P(y_min <= y <= y_max | x), by 32-point Gauss-Legendre
    quadrature on the part of the rectangle within six sigma (error below 1e-6, checked, for
    correlations up to 0.95). The integral is skipped if the marginals determine the result.

    Args:
        mean_m: Mean (x, y).
        covariance: (2, 2) or larger; its first two rows and columns are x and y, m^2.
        bounds_m: x_min, y_min, x_max, y_max.

    Returns:
        In [0, 1]; 0 if the mean or the covariance is not finite.
    """
    x_min, y_min, x_max, y_max = bounds_m
    xx, xy, yy = float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])
    if not (math.isfinite(sum(mean_m)) and math.isfinite(xx + xy + yy)):
        return 0.0
    sx, sy = math.sqrt(max(xx, 1e-18)), math.sqrt(max(yy, 1e-18))
    in_x = _interval((x_min - mean_m[0]) / sx, (x_max - mean_m[0]) / sx)
    in_y = _interval((y_min - mean_m[1]) / sy, (y_max - mean_m[1]) / sy)
    if min(in_x, in_y) < _NOTHING or max(in_x, in_y) > 1.0 - _NOTHING:
        return min(in_x, in_y)
    slope = xy / (sx * sx)
    rest = math.sqrt(max(yy - slope * xy, 1e-12 * yy, 1e-18))
    low = max((x_min - mean_m[0]) / sx, -_REACH_SIGMA)
    high = min((x_max - mean_m[0]) / sx, _REACH_SIGMA)
    half, middle = 0.5 * (high - low), 0.5 * (high + low)
    total = 0.0
    for node, weight in zip(_NODES.tolist(), _WEIGHTS.tolist(), strict=True):
        z = middle + half * node
        y_m = mean_m[1] + slope * sx * z
        inside = _interval((y_min - y_m) / rest, (y_max - y_m) / rest)
        total += weight * math.exp(-0.5 * z * z) * inside
    return min(max(total * half / math.sqrt(2.0 * math.pi), 0.0), 1.0)


def _interval(low: float, high: float) -> float:
    """Return the probability of a standard normal number between two limits."""
    return 0.5 * (math.erf(high / _SQRT2) - math.erf(low / _SQRT2))
