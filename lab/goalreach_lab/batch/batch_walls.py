"""Contact of many robots with the walls at once: `contact` on arrays, number for number."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from goalreach_lab.batch.batch_motion import BatchMotion, displacements
from goalreach_msgs_py.values import FloatArray
from goalreach_sim.contact import BISECTIONS, GRAZE, TOUCH_M, Walls

_CLOSE_M = 1e-15
"""A gap of this size is none: the rounding of a coordinate; chosen."""

_SOON_S = 1e-15
"""Times nearer than this are the same: within it no robot gets far; chosen."""

BoolArray = NDArray[np.bool_]


class BatchWalls:
    """`Walls` for arrays of places, one element per robot.

    Args:
        walls: The walls.
    """

    def __init__(self, walls: Walls) -> None:
        self.walls = walls

    def clearances_m(self, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """Return the gap between each body and its nearest wall, negative where they overlap."""
        walls = self.walls
        across = np.minimum(x_m - walls.low_x_m, walls.high_x_m - x_m)
        along = np.minimum(y_m - walls.low_y_m, walls.high_y_m - y_m)
        nearest_m: FloatArray = np.minimum(across, along)
        return nearest_m

    def clamp(self, x_m: FloatArray, y_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the point of the free floor that is nearest to each place."""
        walls = self.walls
        return (
            np.minimum(np.maximum(x_m, walls.low_x_m), walls.high_x_m),
            np.minimum(np.maximum(y_m, walls.low_y_m), walls.high_y_m),
        )

    def block(
        self, x_m: FloatArray, y_m: FloatArray, direction_x: FloatArray, direction_y: FloatArray
    ) -> BoolArray:
        """Return whom a touched wall stops from moving in a direction (a unit vector)."""
        walls = self.walls
        blocked: BoolArray = (
            ((direction_x < -GRAZE) & (x_m - walls.low_x_m <= TOUCH_M))
            | ((direction_x > GRAZE) & (walls.high_x_m - x_m <= TOUCH_M))
            | ((direction_y < -GRAZE) & (y_m - walls.low_y_m <= TOUCH_M))
            | ((direction_y > GRAZE) & (walls.high_y_m - y_m <= TOUCH_M))
        )
        return blocked

    def gaps_m(
        self, x_m: FloatArray, y_m: FloatArray, motion: BatchMotion, dt_s: FloatArray
    ) -> FloatArray:
        """Return the gap of each body to each wall after it moved for a time, (4, n)."""
        dx_m, dy_m = displacements(motion, dt_s)
        x_m, y_m, walls = x_m + dx_m, y_m + dy_m, self.walls
        return np.stack(
            [x_m - walls.low_x_m, walls.high_x_m - x_m, y_m - walls.low_y_m, walls.high_y_m - y_m]
        )

    def crossing_times(
        self, x_m: FloatArray, y_m: FloatArray, motion: BatchMotion, end_s: FloatArray
    ) -> FloatArray:
        """Return when each body first touches one of the walls that it would be beyond at the end.

        The gap to those walls shrinks all the time. Ridders' method keeps the crossing between
        its two ends ("A new algorithm for computing a single root of a real continuous
        function", 1979).

        Returns:
            Times at which the gaps are not negative, within rounding of the crossing.
        """
        ends_m = self.gaps_m(x_m, y_m, motion, end_s)
        struck = ends_m < -TOUCH_M

        def gap_m(dt_s: FloatArray) -> FloatArray:
            gaps_m = self.gaps_m(x_m, y_m, motion, dt_s)
            smallest_m: FloatArray = np.where(struck, gaps_m, np.inf).min(axis=0)
            return smallest_m

        low_s, high_s = np.zeros_like(end_s), end_s
        low_m, high_m = gap_m(low_s), gap_m(high_s)
        for _ in range(BISECTIONS):
            if ((low_m <= _CLOSE_M) | (high_s - low_s <= _SOON_S)).all():
                break
            middle_s = 0.5 * (low_s + high_s)
            middle_m = gap_m(middle_s)
            root = np.sqrt(np.maximum(middle_m * middle_m - low_m * high_m, 0.0))
            ratio = np.divide(middle_m, root, out=np.zeros_like(root), where=root > 0.0)
            guess_s = np.clip(middle_s + (middle_s - low_s) * ratio, low_s, high_s)
            for time_s, value_m in ((middle_s, middle_m), (guess_s, gap_m(guess_s))):
                before = (value_m >= 0.0) & (time_s > low_s)
                low_s, low_m = np.where(before, time_s, low_s), np.where(before, value_m, low_m)
                after = (value_m < 0.0) & (time_s < high_s)
                high_s = np.where(after, time_s, high_s)
                high_m = np.where(after, value_m, high_m)
        return low_s
