"""One robot that drives for a day: vision and odometry held against the truth, by the minute."""

from __future__ import annotations

from dataclasses import dataclass, field
import math
from typing import Any, Final

import numpy as np

from goalreach_lab.localization.consistency import pose_error
from goalreach_lab.localization.wanderer import Step, Wanderer
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.regions import RegionMap

FRAMES_PER_MINUTE: Final = 1500
BIN_IN: Final = 0.05
"""Width of a bin of the histogram of errors, inches."""
_BINS = 201
"""The last bin takes all that is larger."""


@dataclass
class _Minute:
    """Sums over a minute.

    Attributes:
        bins: Histogram of the error of the pose.
        square_in2: Sum of its squares.
        worst_in: The largest.
        turned_deg2: Sum of the squares of the heading's error.
        nees: Sum of the normalized errors squared.
        wrong: Images whose region by vision is wrong.
        odometry_wrong: The same by odometry.
    """

    bins: list[int] = field(default_factory=lambda: [0] * _BINS)
    square_in2: float = 0.0
    worst_in: float = 0.0
    turned_deg2: float = 0.0
    nees: float = 0.0
    wrong: int = 0
    odometry_wrong: int = 0


class LongRun:
    """A robot that wanders by what it sees, minute after minute.

    Odometry begins at the true pose and is never corrected.

    Args:
        seed: Of everything random.

    Attributes:
        minutes: How many were driven.
    """

    def __init__(self, seed: int) -> None:
        self._robot = Wanderer((seed, 40), noise=noise_preset('nominal'))
        self._regions: RegionMap = Arena().regions
        self.minutes = 0

    def drive(self) -> dict[str, Any]:
        """Drive for a minute and return what was measured, ready for JSON."""
        minute = _Minute()
        step = None
        for step in self._robot.run(FRAMES_PER_MINUTE):
            self._note(step, minute)
        assert step is not None  # noqa: S101 - a minute has images
        self.minutes += 1
        truth, odometry = step.frame.truth.pose, step.frame.odometry.pose
        away_m = math.hypot(odometry.x_m - truth.x_m, odometry.y_m - truth.y_m)
        good = sum(minute.bins)
        last = max((k for k, count in enumerate(minute.bins) if count), default=-1)
        return {
            'minute': self.minutes,
            'good': good,
            'bins': minute.bins[: last + 1],
            'rms_in': math.sqrt(minute.square_in2 / max(1, good)),
            'max_in': minute.worst_in,
            'rms_deg': math.sqrt(minute.turned_deg2 / max(1, good)),
            'nees': minute.nees / max(1, good),
            'region_wrong': minute.wrong,
            'odometry_in': away_m / INCH_M,
            'odometry_deg': math.degrees(abs(pose_error(odometry, truth)[2])),
            'odometry_region_wrong': minute.odometry_wrong,
            'lost': step.output.counters.lost,
        }

    def _note(self, step: Step, minute: _Minute) -> None:
        """Add an image to the sums of a minute."""
        truth, odometry = step.frame.truth.pose, step.frame.odometry.pose
        region = self._regions.region_at(truth.x_m, truth.y_m)
        minute.odometry_wrong += self._regions.region_at(odometry.x_m, odometry.y_m) != region
        if step.output.mode != 'tracking':
            return
        estimate = step.output.estimate
        pose = estimate.pose
        minute.wrong += self._regions.region_at(pose.x_m, pose.y_m) != region
        error = pose_error(pose, truth)
        away_in = math.hypot(error[0], error[1]) / INCH_M
        minute.bins[min(int(away_in / BIN_IN), _BINS - 1)] += 1
        minute.square_in2 += away_in * away_in
        minute.worst_in = max(minute.worst_in, away_in)
        minute.turned_deg2 += math.degrees(error[2]) ** 2
        minute.nees += float(error @ np.linalg.solve(estimate.covariance, error))
