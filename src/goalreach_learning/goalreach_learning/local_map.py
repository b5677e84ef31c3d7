"""A map of what sonar and bumpers have found, kept for a while, and the ways through it.

An evidence grid as of H. P. Moravec and A. Elfes, "High resolution maps from wide angle sonar",
ICRA 1985, with counts in the place of probabilities.
"""

from collections.abc import Sequence
import math
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import FloatArray, Pose2, Scan

# All numbers are chosen, and measured by the study of random arenas.
CELL_M: Final = 0.06
_REACH_M: Final = 1.2
"""Echoes from further away are left for later: their arcs are wide."""
_MIDDLE: Final = 0.3
"""Part of a beam, off its axis, in which an echo counts. What is heard by two beams lies between
these; the gap that is left there is narrower than any obstacle that matters."""
_INNER: Final = 0.4
"""Part of a beam, off its axis, that is taken as free up to the echo: surfaces at its edges, met
aslant, may not have echoed."""
_HIT_M: Final = 0.05
_DEPTH_M: Final = 0.12
"""What is this far behind an echo counts as occupied, too, so that a few echoes of something that
comes nearer fall into the same cells."""
_HIT, _MISS, _TOUCH, _SURE, _MOST = 1.0, 0.5, 20.0, 2.0, 5.0
"""Evidence of an echo, against it and of a touch; from which a cell counts as occupied; at most of
echoes."""
_KEPT: Final = 0.997
"""Part of the evidence that is left after a decision; half of it after 30 s."""
_RIM_RAD: Final = 0.3
"""Half of the arc that a bumper covers, about."""
_WALL_M: Final = 0.14
"""An echo this near to a wall, anywhere across its beam, is the wall's."""
_GAPS_M = np.array([0.2, 0.1, 0.02, -0.08])[:, None, None]
COSTS: Final = (1, 3, 9, 27, 81)
"""Cost of a metre, and the gaps below which it rises. Where the map says that the body does not
fit it is finite, because the map may err. Each is a multiple of the one before."""
_INSET_M: Final = 0.1
"""Ways lead this far into a region, where the robot is sure to be there."""
_MOST_STEPS: Final = 600
_BEYOND: Final = 20
"""Steps of a wave after it has reached the robot: what is around it is reached, too."""
_ENTERED = [sum(step % cost == 0 for cost in COSTS[1:]) for step in range(_MOST_STEPS + 1)]
"""Index of the highest cost whose cells are entered in a step."""
_NEIGHBOURS = [
    cv2.getStructuringElement(shape, (3, 3)) for shape in (cv2.MORPH_CROSS, cv2.MORPH_RECT)
]


class LocalMap:
    """Evidence of obstacles in cells of the floor, whose walls are the outer knots of the regions.

    Attributes:
        empty: Whether nothing is known to be there besides the walls.
        walls_m: Gap between a body centred in each cell and the nearest wall.
        obstacles_m: The same for obstacles; metres more than the arena has, where there are none.
        costs: Cost of a metre of the way in each cell, of `COSTS`.
    """

    def __init__(self, regions: RegionMap, body_radius_m: float) -> None:
        self._radius_m = body_radius_m
        width_m, length_m = regions.x_knots_m[-1], regions.y_knots_m[-1]
        columns, rows = math.ceil(width_m / CELL_M), math.ceil(length_m / CELL_M)
        self._x_m = CELL_M * (np.arange(columns, dtype=np.float64) + 0.5)[:, None]
        self._y_m = CELL_M * (np.arange(rows, dtype=np.float64) + 0.5)[None, :]
        across_m = np.minimum(self._x_m, width_m - self._x_m)
        along_m = np.minimum(self._y_m, length_m - self._y_m)
        self.walls_m: FloatArray = np.minimum(across_m, along_m) - body_radius_m
        self._evidence: FloatArray = np.zeros((columns, rows))
        self._measure()

    def update(self, pose: Pose2, base_rad: float, scan: Scan, touched: Sequence[float]) -> None:
        """Add what was found at a moment: the scan, and the azimuths in `map` of what is touched.

        The bearings of the scan count from the azimuth `base_rad` in `map`.
        """
        foreign = self._foreign(scan, base_rad, pose)
        if self.empty and not touched and not foreign.any():
            return
        self._evidence *= _KEPT
        (i, j), reach = self.cells(pose), round(_REACH_M / CELL_M)
        near = slice(max(i - reach, 0), i + reach + 1), slice(max(j - reach, 0), j + reach + 1)
        evidence = self._evidence[near]
        dx_m, dy_m = self._x_m[near[0]] - pose.x_m, self._y_m[:, near[1]] - pose.y_m
        range_m, azimuth = np.sqrt(dx_m * dx_m + dy_m * dy_m), np.arctan2(dy_m, dx_m)
        most = np.maximum(evidence, _MOST)
        evidence += self._heard(range_m, azimuth - scan.first_rad - base_rad, scan, foreign)
        np.clip(evidence, 0.0, most, out=evidence)
        evidence[range_m < self._radius_m - CELL_M / 2] = 0.0
        for touch in touched:
            turn = np.abs((azimuth - touch + math.pi) % math.tau - math.pi)
            at_rim = np.abs(range_m - self._radius_m - CELL_M / 2) < CELL_M
            evidence[at_rim & (turn < _RIM_RAD)] = _TOUCH
        self._measure()

    def _heard(
        self, range_m: FloatArray, bearing: FloatArray, scan: Scan, foreign: NDArray[np.bool_]
    ) -> FloatArray:
        """Return the evidence of a scan for cells at ranges and bearings."""
        beam = (bearing % math.tau) / scan.step_rad
        ray = np.rint(beam).astype(np.int64)
        off = np.abs(beam - ray)
        # Beyond the last ray nothing is heard; a ring begins anew.
        ray = np.minimum(ray % round(math.tau / scan.step_rad), len(scan.ranges_m))
        heard_m = np.nan_to_num(np.array([*scan.ranges_m, 0.0])[ray], posinf=0.0)
        ahead_m = heard_m - range_m
        miss = (off < _INNER) & (ahead_m > CELL_M)
        hit = (ahead_m < _HIT_M) & (ahead_m > -_DEPTH_M) & (off < _MIDDLE)
        return np.where(miss, -_MISS, np.where(hit & np.append(foreign, False)[ray], _HIT, 0.0))

    def _foreign(self, scan: Scan, base_rad: float, pose: Pose2) -> NDArray[np.bool_]:
        """Return which echoes are near, and cannot be those of the walls."""
        heard_m = np.array(scan.ranges_m)
        axes = base_rad + scan.first_rad + scan.step_rad * np.arange(len(heard_m))
        across = axes[:, None] + scan.step_rad * np.array([-0.5, -0.25, 0.0, 0.25, 0.5])
        range_m = np.minimum(heard_m, _REACH_M)[:, None]
        to_wall_m = self.walls_m[self.cells(pose, across, range_m)] + self._radius_m
        return np.where(to_wall_m.min(axis=1) > _WALL_M, heard_m < _REACH_M, False)

    def _measure(self) -> None:
        """Derive gaps and costs from the evidence."""
        free = self._evidence < _SURE
        self.empty = bool(free.all())
        distance = cv2.distanceTransform(free.view(np.uint8), cv2.DIST_L2, 5)
        self.obstacles_m = (distance * CELL_M - self._radius_m).astype(np.float64)
        gaps_m = np.minimum(self.obstacles_m, self.walls_m)
        self.costs = np.array(COSTS, float)[(gaps_m < _GAPS_M).sum(axis=0)]

    def cells(
        self, pose: Pose2, heading_rad: FloatArray | float = 0.0, ahead_m: FloatArray | float = 0.0
    ) -> tuple[NDArray[np.int64], ...]:
        """Return the cells ahead of a pose in some directions, as indices of every field."""
        x_m = pose.x_m + np.cos(heading_rad) * ahead_m
        y_m = pose.y_m + np.sin(heading_rad) * ahead_m
        return tuple(
            np.clip((at_m / CELL_M).astype(np.int64), 0, count - 1)
            for at_m, count in zip((x_m, y_m), self.walls_m.shape, strict=True)
        )

    def ways_m(self, to_m: tuple[float, float, float, float], at: Pose2) -> FloatArray:
        """Return the cost of the way from each cell around a pose to a rectangle.

        A wave spreads from the rectangle (lowest x and y, highest x and y), a cell a step,
        alternately to four and to eight neighbours; it enters a cell of cost c in every c-th step.
        """
        x0_m, y0_m, x1_m, y1_m = to_m
        inside = (self._x_m > x0_m + _INSET_M) & (self._x_m < x1_m - _INSET_M)
        inside = inside & (self._y_m > y0_m + _INSET_M) & (self._y_m < y1_m - _INSET_M)
        free = inside & (self.costs < COSTS[3])
        reached = (free if free.any() else inside).astype(np.uint8)
        enters = [(self.costs <= cost).astype(np.uint8) for cost in COSTS]
        steps = np.zeros(reached.shape, np.float32)
        grown, here = np.empty_like(reached), self.cells(at)
        step, last = 0, _MOST_STEPS
        while step < last:
            last, step = min(last, step + _BEYOND) if reached[here] else last, step + 1
            cv2.dilate(reached, _NEIGHBOURS[step % 2], dst=grown)
            cv2.bitwise_and(grown, enters[_ENTERED[step]], dst=grown)
            cv2.bitwise_or(reached, grown, dst=reached)
            cv2.accumulate(reached, steps)
        return (step - steps.astype(np.float64)) * CELL_M
