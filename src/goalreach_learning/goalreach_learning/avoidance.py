"""The behaviours that keep a robot from obstacles: avoid, escape, patience."""

import cmath
from dataclasses import dataclass, field
import math
from typing import Final

import numpy as np

from goalreach_learning.behaviors import Proposal, Senses
from goalreach_learning.local_map import CELL_M
from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.values import FloatArray

# All numbers are chosen, and measured by the study of random arenas.
_WEIGHT: Final = 1000.0
"""Where there is an obstacle ahead, goal-reaching has next to no say."""
_GAP_M: Final = 0.1
_DANGER_M: Final = 0.05
_HEED_M: Final = 0.5
_STEP_M: Final = 0.06
_SAMPLES = np.arange(1, 16, dtype=np.float64) * _STEP_M
"""Places along a direction, up to where the way must be free for `avoid` to say nothing."""
_HEADINGS = np.arange(32, dtype=np.float64)[:, None] * (math.tau / 32)
_PLAN_S: Final = 0.45
"""Time from one plan to the next."""
_AGREE_RAD: Final = math.radians(30.0)
"""A detour ends where goal-reaching wants to go the same way."""
_SLOWEST_M_PER_S: Final = 0.1
_TURN_COST_M: Final = 0.15
"""Length of the way that a turn of a radian is worth."""
_BACK_S: Final = 1.0
_BACK_M_PER_S: Final = 0.25


@dataclass
class Avoid:
    """Keeps clear of what the map holds, and goes round it.

    Where goal-reaching would come too near to something within 0.9 m, it plans a way to the goal
    region through the map, and proposes its direction with a large weight. It goes on until
    goal-reaching wants to go the same way, which leads out of dead ends. Where nothing is in the
    way it proposes nothing.

    An obstacle may hide the landmarks. The robot then goes on along the way by odometry, slowly.
    """

    _ways_m: FloatArray | None = None
    _planned_s: float = -math.inf
    _detours: bool = False
    _last_rad: float | None = None

    def __call__(self, senses: Senses) -> Proposal | None:
        """Return a direction that is free, a speed limit where something is near, or None."""
        wanted = senses.goal.heading_rad if senses.goal else None
        if senses.map.empty or (wanted is None and senses.sure):
            self._detours = False
            return None
        blocked = wanted is None or _blocked(senses, wanted)
        limit = _course_limit(senses)
        if not (blocked or self._detours or senses.gap_m < _DANGER_M):
            self._last_rad = self._ways_m = None
            return Proposal(limit_m_per_s=limit) if limit < math.inf else None
        heading_rad = self._best(senses)
        apart_rad = math.pi if wanted is None else angle_difference(heading_rad, wanted)
        self._detours = blocked or abs(apart_rad) > _AGREE_RAD
        return Proposal(
            heading_rad=heading_rad,
            weight=_WEIGHT,
            limit_m_per_s=limit if senses.sure else min(limit, _BACK_M_PER_S),
            either_way=True,
        )

    def _best(self, senses: Senses) -> float:
        """Return the direction that leads on best, or away from what is too near."""
        if senses.gap_m < _DANGER_M:
            return _away(senses)
        if self._ways_m is None or senses.time_s - self._planned_s >= _PLAN_S:
            self._planned_s = senses.time_s
            goal_m = senses.regions.bounds(senses.regions.goal)
            self._ways_m = senses.map.ways_m(goal_m, senses.pose)
        cells = senses.map.cells(senses.pose, _HEADINGS, _SAMPLES[:8])
        costs = np.cumsum(senses.map.costs[cells], axis=1) * _STEP_M + self._ways_m[cells]
        facing = senses.pose.heading_rad if self._last_rad is None else self._last_rad
        rank = costs[:, 2:].min(axis=1) + _TURN_COST_M * np.minimum(_turns(facing), math.pi / 2)
        self._last_rad = wrap_angle(float(_HEADINGS[int(np.argmin(rank)), 0]))
        return self._last_rad


def _turns(from_rad: float) -> FloatArray:
    turns: FloatArray = np.abs((_HEADINGS[:, 0] - from_rad + math.pi) % math.tau - math.pi)
    return turns


def _course_limit(senses: Senses) -> float:
    """Return the speed at which the robot may drive on while its course nears something."""
    ahead_m = np.array([0.0, math.copysign(_COURSE_M, senses.speed_m_per_s)])
    cells = senses.map.cells(senses.pose, senses.pose.heading_rad, ahead_m)
    here_m, there_m = senses.map.walls_m[cells].tolist()
    if there_m < min(_DANGER_M, here_m - _DANGER_M / 2):
        return _SLOWEST_M_PER_S
    here_m, there_m = senses.map.obstacles_m[cells].tolist()
    nears = there_m < min(here_m - CELL_M, _HEED_M)
    return _SLOWEST_M_PER_S + max(there_m, 0.0) if nears else math.inf


def _blocked(senses: Senses, heading_rad: float) -> bool:
    """Return whether an obstacle is ahead."""
    cells = senses.map.cells(senses.pose, heading_rad, _SAMPLES)
    return bool((senses.map.obstacles_m[cells] < _GAP_M).any())


_COURSE_M: Final = 0.25
_STEER_COST_M, _REVERSE_COST_M = 0.4, 0.15
"""Room that a radian of steering, or turning back, is worth where there is no time for it."""


def _away(senses: Senses) -> float:
    """Return the direction that leads to the most room, at once if possible."""
    cells = senses.map.cells(senses.pose, _HEADINGS, _SAMPLES[2:8:3])
    gaps_m = np.minimum(senses.map.obstacles_m[cells], senses.map.walls_m[cells]).min(axis=1)
    turns = _turns(senses.pose.heading_rad)
    reverses = (turns > math.pi / 2) != (senses.speed_m_per_s < 0.0)
    costs_m = _STEER_COST_M * np.minimum(turns, math.pi - turns) + _REVERSE_COST_M * reverses
    return wrap_angle(float(_HEADINGS[int(np.argmax(gaps_m - costs_m)), 0]))


@dataclass
class Escape:
    """Backs off along the normal of what the bumpers touch; the map remembers the place."""

    _until_s: float = -math.inf
    _away_rad: float = 0.0

    def __call__(self, senses: Senses) -> Proposal | None:
        """Return the way off, until a second after the last touch."""
        if senses.touched_rad:
            self._away_rad = cmath.phase(-sum(cmath.rect(1.0, one) for one in senses.touched_rad))
            self._until_s = senses.time_s + _BACK_S
        if senses.time_s >= self._until_s:
            return None
        return Proposal(heading_rad=self._away_rad, limit_m_per_s=_BACK_M_PER_S, either_way=True)


_MEMORY_S: Final = 0.7
_MOVED_M: Final = 0.09
"""Nearer by this within the memory, where the robot is, counts as coming: more than a cell."""
_PATIENCE_S: Final = 1.5


@dataclass
class Patience:
    """Gives way to what comes nearer by itself."""

    _fields: list[tuple[float, FloatArray]] = field(default_factory=list)
    _until_s: float = -math.inf

    def __call__(self, senses: Senses) -> Proposal | None:
        """Return the way off, until a while after something came nearer, or None."""
        if senses.map.empty:
            self._fields.clear()
            return None
        now_s, gap_m = senses.time_s, senses.gap_m
        self._fields = [(s, one) for s, one in self._fields if s >= now_s - _MEMORY_S]
        self._fields.append((now_s, senses.map.obstacles_m))
        before_m = float(self._fields[0][1][senses.map.cells(senses.pose)])
        if before_m - gap_m > _MOVED_M and gap_m < _HEED_M:
            self._until_s = now_s + _PATIENCE_S
        if now_s >= self._until_s:
            return None
        return Proposal(heading_rad=_away(senses), weight=30.0, either_way=True)
