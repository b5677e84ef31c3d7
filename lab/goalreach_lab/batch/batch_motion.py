"""The motion of many robots at once: `path_integral` on arrays, number for number.

Every array has one element per robot.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray
from goalreach_sim.axis import DONE_S
from goalreach_sim.path_integral import GAUSS_NODES, PANEL_RAD, SOON_S

_QUARTER_RAD = math.pi / 2.0


class BatchMotion(NamedTuple):
    """Motions with constant accelerations; the fields are those of `path_integral.Motion`."""

    heading_rad: FloatArray
    turn_rad_per_s: FloatArray
    turn_rad_per_s2: FloatArray
    speed_m_per_s: FloatArray
    acceleration_m_per_s2: FloatArray

    def of(self, chosen: NDArray[np.intp]) -> BatchMotion:
        """Return the motions of some of the robots."""
        return BatchMotion(*(values[chosen] for values in self))


def displacements(motion: BatchMotion, dt_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how far the robots get along x and y, each in its own time, metres.

    All take as many panels as the one that turns furthest needs.

    Args:
        motion: How they move.
        dt_s: For how long.
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
        motion: How they move.
        limit_s: The longest time of each.
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
    """Return end velocity, duration and acceleration of the present piece of a ramp."""
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
    """Change velocities in place; at the end of a piece they are exactly what they should be."""
    done = piece_s - step_s <= DONE_S
    velocity[...] = np.where(done, end, velocity + acceleration * step_s)
