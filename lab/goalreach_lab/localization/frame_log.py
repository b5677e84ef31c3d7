"""True and estimated poses frame by frame: errors, consistency, overconfident episodes, gaps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import INCH_M, angle_difference
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import Confidence, FloatArray, Pose2, PoseEstimate, RegionState
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_perception.pose_filter import PoseFilter
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig
from goalreach_sim.sensors import SensorFrame

WRONG_IN: Final = 6.0
"""A pose with a larger position error is wrong, inches; chosen: half of a region's narrowest
transition area."""
WRONG_NEES: Final = 30.7
"""A pose with a larger NEES is outside its own covariance: chi-square, 3 degrees of freedom,
p = 1e-6."""


def pose_error(estimate: Pose2, truth: Pose2) -> FloatArray:
    """Return the error (3,) of x, y (m) and heading (rad, wrapped)."""
    turned = angle_difference(estimate.heading_rad, truth.heading_rad)
    return np.array([estimate.x_m - truth.x_m, estimate.y_m - truth.y_m, turned])


def pose_nees(estimate: PoseEstimate, truth: Pose2) -> float:
    """Return the normalized estimation error squared of a pose, 3 degrees of freedom."""
    error = pose_error(estimate.pose, truth)
    return float(error @ np.linalg.solve(estimate.covariance, error))


class Frames(NamedTuple):
    """The frames of one drive in order, one array element per frame.

    Attributes:
        time_s: Time on the robot's clock.
        error_in: Position error, inches; NaN where no pose was published.
        turned_deg: Signed heading error, degrees; NaN where no pose was published.
        nees: Normalized estimation error squared; NaN where no pose was published.
        trusted: Whether a pose was published and the state had confidence OK.
        leds: Number of identified LEDs.
        nis: Normalized innovation squared; zero where no image corrected the filter.
        nis_dof: Its degrees of freedom.
    """

    time_s: FloatArray
    error_in: FloatArray
    turned_deg: FloatArray
    nees: FloatArray
    trusted: NDArray[np.bool_]
    leds: NDArray[np.int64]
    nis: FloatArray
    nis_dof: FloatArray

    @classmethod
    def join(cls, drives: Sequence['Frames']) -> 'Frames':
        """Return the frames of several drives as those of one."""
        return cls(*map(np.concatenate, zip(*drives, strict=True)))

    @classmethod
    def from_json(cls, result: Mapping[str, Any]) -> 'Frames':
        """Return the frames of a result that `to_json` made."""
        columns: dict[str, Any] = {
            name: np.array(result[name], dtype=np.float64) for name in cls._fields
        }
        columns['trusted'] = columns['trusted'] > 0.0
        columns['leds'] = columns['leds'].astype(np.int64)
        return cls(**columns)

    def to_json(self) -> dict[str, Any]:
        """Return the frames as lists by name, rounded to five decimals."""
        return {
            name: np.asarray(values, dtype=np.float64).round(5).tolist()
            for name, values in zip(self._fields, self, strict=True)
        }

    @property
    def wrong(self) -> NDArray[np.bool_]:
        """Whether a pose was trusted that is far off, or far outside its own covariance."""
        far: NDArray[np.bool_] = (self.error_in > WRONG_IN) | (self.nees > WRONG_NEES)
        return self.trusted & far


class FrameLog:
    """Collects the frames of a drive.

    Args:
        pose_filter: The localizer's filter, where its innovations are wanted too.
    """

    def __init__(self, pose_filter: PoseFilter | None = None) -> None:
        self._rows: list[tuple[float, ...]] = []
        self._estimator = StateEstimator(StateEstimatorConfig.for_arena(Arena()))
        self._filter = pose_filter
        self._counted = (0, 0)

    def add_output(self, frame: SensorFrame, output: LocalizerOutput) -> bool:
        """Add a frame, estimating its state; return whether its pose is trusted."""
        state = self._estimator.estimate(output.estimate)
        self.add(frame, output, state)
        return output.mode == 'tracking' and state.confidence is Confidence.OK

    def add(self, frame: SensorFrame, output: LocalizerOutput, state: RegionState) -> None:
        """Add a frame with its state."""
        tracking = output.mode == 'tracking'
        error_in = turned_deg = nees = math.nan
        if tracking:
            truth = frame.truth.pose
            dx_m, dy_m, turned = pose_error(output.estimate.pose, truth).tolist()
            error_in, turned_deg = math.hypot(dx_m, dy_m) / INCH_M, math.degrees(turned)
            nees = pose_nees(output.estimate, truth)
        trusted = tracking and state.confidence is Confidence.OK
        leds = sum(landmark is not None for landmark in output.landmarks)
        time_s = frame.time_ns * 1e-9
        innovation = self._innovation(output)
        self._rows.append((time_s, error_in, turned_deg, nees, trusted, leds, *innovation))

    def _innovation(self, output: LocalizerOutput) -> tuple[float, int]:
        """Return NIS and degrees of freedom where an image corrected the filter, else zeros."""
        counters, before = output.counters, self._counted
        self._counted = (counters.corrections, counters.acquired)
        corrected = counters.corrections > before[0] and counters.acquired == before[1]
        return self._filter.last_innovation if self._filter is not None and corrected else (0.0, 0)

    def take(self) -> Frames:
        """Return the collected frames and start over."""
        columns = np.array(self._rows, dtype=np.float64).reshape(-1, len(Frames._fields)).T
        self._rows = []
        return Frames.from_json(dict(zip(Frames._fields, columns, strict=True)))


def percentiles(values: FloatArray) -> dict[str, float]:
    """Return rms, median, p95 and max of absolute errors; NaN where there are none."""
    if len(values) == 0:
        return dict.fromkeys(('rms', 'median', 'p95', 'max'), math.nan)
    sizes = np.abs(values)
    median, p95 = np.percentile(sizes, [50.0, 95.0]).tolist()
    rms = float(np.sqrt(np.mean(sizes * sizes)))
    return {'rms': rms, 'median': median, 'p95': p95, 'max': float(sizes.max())}


def error_summary(frames: Frames) -> dict[str, Any]:
    """Return errors of the trusted poses, availability and the share of frames by LEDs seen."""
    good, count = frames.trusted, len(frames.time_s)
    leds = np.bincount(frames.leds, minlength=4) / max(1, count)
    return {
        'frames': count,
        'position_in': percentiles(frames.error_in[good]),
        'heading_deg': percentiles(frames.turned_deg[good]),
        'available': float(good.mean()),
        'leds': leds.tolist(),
    }


@dataclass(frozen=True, kw_only=True)
class OverconfidentEpisode:
    """A time in which a wrong pose was trusted.

    Attributes:
        began_s: When it began, on the robot's clock.
        detected_s: How long the wrong pose was trusted.
        recovered_s: Time until a right pose was trusted; infinite where the drive ended before.
        worst_in: Largest position error in it, inches.
    """

    began_s: float
    detected_s: float
    recovered_s: float
    worst_in: float


def overconfident_episodes(frames: Frames) -> list[OverconfidentEpisode]:
    """Return every episode of a drive in which a wrong pose was trusted."""
    times, wrong = frames.time_s, frames.wrong
    right = frames.trusted & ~wrong
    count = len(times)

    def next_where(condition: NDArray[np.bool_], start: int) -> int:
        found = np.flatnonzero(condition[start:])
        return start + int(found[0]) if len(found) else count

    episodes: list[OverconfidentEpisode] = []
    first = next_where(wrong, 0)
    while first < count:
        end, recovered = next_where(~wrong, first), next_where(right, first)
        began_s = float(times[first])
        episodes.append(
            OverconfidentEpisode(
                began_s=began_s,
                detected_s=float(times[min(end, count - 1)]) - began_s,
                recovered_s=float(times[recovered]) - began_s if recovered < count else math.inf,
                worst_in=float(np.nanmax(frames.error_in[first:end])),
            )
        )
        first = next_where(wrong, recovered)
    return episodes


def longest_gap_s(frames: Frames) -> float:
    """Return the longest time without a trusted pose after the first one, seconds."""
    good = frames.time_s[frames.trusted]
    if len(good) == 0:
        return math.inf
    ends = np.append(good, frames.time_s[-1])
    period = float(np.median(np.diff(frames.time_s))) if len(frames.time_s) > 1 else 0.0
    return max(0.0, float(np.diff(ends).max()) - period)
