"""What was true and what was believed, frame by frame, as columns of numbers."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from goalreach_lab.localization.consistency import pose_error, pose_nees
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import Confidence, FloatArray, RegionState
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_perception.pose_filter import PoseFilter
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig
from goalreach_sim.sensors import SensorFrame

WRONG_IN: Final = 6.0
"""A pose that far off is wrong, inches; chosen: half of a region's narrowest transition area."""
FAR_NEES: Final = 30.7
"""A pose is outside its own covariance above this: chi-square, 3 degrees of freedom, p = 1e-6."""

_TIME, _ERROR, _TURNED, _NEES, _TRUSTED, _LEDS, _TRACKING, _NIS, _NIS_DOF = range(9)


class FrameLog:
    """Collects frames.

    Args:
        state: The localizer's filter, where its innovations are wanted too.
    """

    def __init__(self, state: PoseFilter | None = None) -> None:
        self._rows: list[tuple[float, ...]] = []
        self._estimator = StateEstimator(StateEstimatorConfig.for_arena(Arena()))
        self._state = state
        self._counted = (0, 0)

    def look(self, frame: SensorFrame, output: LocalizerOutput) -> bool:
        """Add a frame whose state nobody computed; return whether its pose counts as good."""
        state = self._estimator.estimate(output.estimate)
        self.add(frame, output, state)
        return output.mode == 'tracking' and state.confidence is Confidence.OK

    def add(self, frame: SensorFrame, output: LocalizerOutput, state: RegionState) -> None:
        """Add a frame."""
        counters = output.counters
        tracking = output.mode == 'tracking'
        error_in = turned_deg = nees = math.nan
        if tracking:
            truth = frame.truth.pose
            dx_m, dy_m, turned = pose_error(output.estimate.pose, truth).tolist()
            error_in, turned_deg = math.hypot(dx_m, dy_m) / INCH_M, math.degrees(turned)
            nees = pose_nees(output.estimate, truth)
        innovation = (0.0, 0)
        followed = (counters.corrections > self._counted[0]) and (
            counters.acquired == self._counted[1]
        )
        if self._state is not None and followed:
            innovation = self._state.accepted
        self._counted = (counters.corrections, counters.acquired)
        leds = sum(landmark is not None for landmark in output.landmarks)
        trusted = tracking and state.confidence is Confidence.OK
        time_s = frame.time_ns * 1e-9
        self._rows.append(
            (time_s, error_in, turned_deg, nees, trusted, leds, tracking, *innovation)
        )

    def take(self) -> Frames:
        """Return what was collected, and begin anew."""
        rows = np.array(self._rows, dtype=np.float64).reshape(-1, 9)
        self._rows = []
        return Frames(rows)


class Frames:
    """Frames of one drive, in order.

    Args:
        rows: (n, 9) as `FrameLog` collects them.
    """

    def __init__(self, rows: FloatArray) -> None:
        self._rows = rows

    def __len__(self) -> int:
        """Return their number."""
        return len(self._rows)

    @classmethod
    def joined(cls, parts: Sequence[Frames]) -> Frames:
        """Return the frames of several drives as if they were one."""
        return cls(np.concatenate([part._rows for part in parts]))  # noqa: SLF001 - its own kind

    def since(self, time_s: float) -> Frames:
        """Return those from a time on."""
        return Frames(self._rows[self._rows[:, _TIME] >= time_s])

    @property
    def time_s(self) -> FloatArray:
        """The robot's clock."""
        return self._rows[:, _TIME]

    @property
    def trusted(self) -> NDArray[np.bool_]:
        """Whether a good pose was published."""
        return self._rows[:, _TRUSTED] > 0.0

    @property
    def error_in(self) -> FloatArray:
        """Error of the position, inches; NaN where none was published."""
        return self._rows[:, _ERROR]

    @property
    def turned_deg(self) -> FloatArray:
        """Error of the heading, degrees, with its sign."""
        return self._rows[:, _TURNED]

    @property
    def nees(self) -> FloatArray:
        """Normalized estimation error squared, 3 degrees of freedom; NaN without a pose."""
        return self._rows[:, _NEES]

    @property
    def nis(self) -> FloatArray:
        """Normalized innovation squared; zero where no image corrected the filter."""
        return self._rows[:, _NIS]

    @property
    def nis_dof(self) -> FloatArray:
        """Its degrees of freedom."""
        return self._rows[:, _NIS_DOF]

    @property
    def leds(self) -> FloatArray:
        """How many LEDs were seen and named."""
        return self._rows[:, _LEDS]

    @property
    def wrong(self) -> NDArray[np.bool_]:
        """Whether a pose was believed that is far off, or far outside its own covariance."""
        far: NDArray[np.bool_] = (self.error_in > WRONG_IN) | (self.nees > FAR_NEES)
        return self.trusted & far


def percentiles(values: FloatArray) -> dict[str, float]:
    """Return rms, median, p95 and max of errors; NaN where there are none."""
    if len(values) == 0:
        return dict.fromkeys(('rms', 'median', 'p95', 'max'), math.nan)
    sizes = np.abs(values)
    median, p95 = np.percentile(sizes, [50.0, 95.0]).tolist()
    rms = float(np.sqrt(np.mean(sizes * sizes)))
    return {'rms': rms, 'median': median, 'p95': p95, 'max': float(sizes.max())}
