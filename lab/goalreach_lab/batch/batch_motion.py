"""Motion and wall contact of many robots: `path_integral` and `contact` on arrays.

The same results, number for number. Every array has one element per robot.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray
from goalreach_sim.axis import DONE_S
from goalreach_sim.path_integral import GAUSS_NODES, PANEL_RAD, SOON_S
from goalreach_sim.robot import BISECTIONS, GRAZE, TOUCH_M, Walls

_QUARTER_RAD = math.pi / 2.0
_CLOSE_M = 1e-15
"""A gap of this size is rounding of a coordinate; chosen."""
_SAME_S = 1e-15
"""Times nearer than this are the same: within it no robot gets far; chosen."""

BoolArray = NDArray[np.bool_]


class BatchMotion(NamedTuple):
    """Motions with constant accelerations; the fields are those of `path_integral.Motion`."""

    heading_rad: FloatArray
    turn_rad_per_s: FloatArray
    turn_rad_per_s2: FloatArray
    speed_m_per_s: FloatArray
    acceleration_m_per_s2: FloatArray

    def of(self, chosen: NDArray[np.intp]) -> 'BatchMotion':
        """Return the motions of some of the robots."""
        return BatchMotion(*(values[chosen] for values in self))


def displacements(motion: BatchMotion, dt_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the displacements of the robots along x and y, each in its own time, metres.

    All take as many panels as the robot with the largest turn needs.

    Args:
        motion: Their motions.
        dt_s: Duration of each.
    """
    heading_rad, turn, turn_change, speed, acceleration = motion
    turns_rad = (np.abs(turn) + np.abs(turn_change) * dt_s) * dt_s
    panels = max(1, math.ceil(float(turns_rad.max(initial=0.0)) / PANEL_RAD))
    panel_s = dt_s / panels
    half_change = 0.5 * turn_change
    x_m, y_m = np.zeros_like(dt_s), np.zeros_like(dt_s)
    for panel in range(panels):
        for node, weight in GAUSS_NODES:
            t = (panel + node) * panel_s
            angle = heading_rad + (turn + half_change * t) * t
            step_m = weight * (speed + acceleration * t)
            x_m += step_m * np.cos(angle)
            y_m += step_m * np.sin(angle)
    return x_m * panel_s, y_m * panel_s


def quarter_turn_times(motion: BatchMotion, limit_s: FloatArray) -> FloatArray:
    """Return when each heading next passes a multiple of a quarter turn, at most `limit_s`.

    Args:
        motion: Their motions.
        limit_s: Largest time of each.
    """
    heading_rad, turn, turn_change, _, _ = motion
    a, b = 0.5 * turn_change, turn
    nearest = np.rint(heading_rad / _QUARTER_RAD)
    earliest_s = limit_s
    for side in (-1.0, 0.0, 1.0):
        c = heading_rad - (nearest + side) * _QUARTER_RAD
        q = -0.5 * (b + np.copysign(np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0)), b))
        real = b * b >= 4.0 * a * c
        for above, below in ((q, a), (c, q)):
            some = real & (below != 0.0)
            root_s = np.divide(above, below, out=np.full_like(above, np.inf), where=some)
            earliest_s = np.where(root_s > SOON_S, np.minimum(earliest_s, root_s), earliest_s)
    return earliest_s


def ramp_piece(
    velocity: FloatArray, target: FloatArray, acceleration: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return end velocity, duration and acceleration of the current piece of a ramp."""
    end = np.where(velocity * target < 0.0, 0.0, target)
    change = end - velocity
    steady = change == 0.0
    duration_s = np.where(steady, np.inf, np.abs(change) / acceleration)
    return end, duration_s, np.sign(change) * acceleration


def follow_ramp(
    velocity: FloatArray,
    acceleration: FloatArray,
    step_s: FloatArray,
    end: FloatArray,
    piece_s: FloatArray,
) -> None:
    """Update velocities in place; at the end of a piece they equal the end velocity exactly."""
    done = piece_s - step_s <= DONE_S
    velocity[...] = np.where(done, end, velocity + acceleration * step_s)


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
        """Return which bodies a touched wall keeps from moving in a direction (a unit vector)."""
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
        """Return when each body first touches a wall that it would be beyond at the end.

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
            if ((low_m <= _CLOSE_M) | (high_s - low_s <= _SAME_S)).all():
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
