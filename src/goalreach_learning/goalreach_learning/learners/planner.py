"""A learner that plans: equation (1) on options imagined between the real ones.

Dyna (R. S. Sutton, "Integrated Architectures for Learning, Planning, and Reacting", ICML 1990) on
a model of the floor, with optimism where it ends (R. I. Brafman and M. Tennenholtz, "R-max", JMLR
3, 2002). Where the robot was is floor, where the region changed a border; a bump shows a wall.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import itertools
import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from goalreach_learning.learner import Experience, LearnerSetup, Situation
from goalreach_learning.q_learning import q_update
from goalreach_msgs_py.regions import Rewards
from goalreach_msgs_py.values import FloatArray, PathOutcome, Region

_SQUARE: Final = math.cos(math.radians(14.0))
"""A wall this near to an axis is taken as parallel: bumpers tell its direction to 9 degrees, and
slip turns the base by a few. Chosen."""
_MARGIN_M: Final = 0.08
"""Coming this near to a wall counts as a bump: a robot passes a border by 5 cm before it turns,
and its estimate is wrong by up to 2 cm. Chosen."""
BORDER_M: Final = 0.2
"""A border that was crossed lies at most so far from where the crossing was noticed. Chosen."""
_OPTIMISM: Final = 0.8  # of the best reward, for the unknown: a goal three actions away. Chosen
_POINTS: Final = 3  # along each side of a region, from which options are imagined. Chosen
_TINY: Final = 1e-9  # rounding of a length, and of an approach to a wall per metre. Chosen
_WALL: Final = (-1, -1)  # in place of a region: what an option that ends at a wall enters

_Vector = tuple[float, float]
_End = Region | None  # the region entered; None if unknown


class Wall(NamedTuple):
    """A wall as felt: how far the robot's centre gets along a direction.

    Attributes:
        x: Unit vector towards it.
        y: Unit vector towards it.
        limit_m: Largest x * x_m + y * y_m of the centre, metres.
    """

    x: float
    y: float
    limit_m: float

    def gap_m(self, at_m: _Vector) -> float:
        """Return how far a robot at a point is from it, negative beyond it."""
        return self.limit_m - self.x * at_m[0] - self.y * at_m[1]


def with_wall(walls: Sequence[Wall], azimuth_rad: float, at_m: _Vector) -> list[Wall]:
    """Return the walls with one touched in an azimuth by a robot at a point, or touched again."""
    x, y = math.cos(azimuth_rad), math.sin(azimuth_rad)
    x, y = (round(x), round(y)) if max(abs(x), abs(y)) >= _SQUARE else (x, y)
    others = [wall for wall in walls if wall.x * x + wall.y * y < _SQUARE]
    return [*others, Wall(x, y, x * at_m[0] + y * at_m[1])]


def free_length_m(walls: Sequence[Wall], at_m: _Vector, direction: _Vector) -> float:
    """Return how far a robot at a point can drive in a direction, up to the margin of a wall."""
    x, y = direction
    ahead = ((wall.gap_m(at_m) - _MARGIN_M, wall.x * x + wall.y * y) for wall in walls)
    return min((gap / slope for gap, slope in ahead if slope > _TINY), default=math.inf)


@dataclass
class Extents:
    """How far columns and rows extend, as a robot finds out that is told only its region.

    Attributes:
        spans_m: By index of the columns, and of the rows, that were entered: smallest and largest
            coordinate at which the robot's centre was, metres.
    """

    spans_m: tuple[dict[int, _Vector], ...] = field(default_factory=lambda: ({}, {}))

    def enter(self, region: Region, at_m: _Vector) -> None:
        """Learn that a place belongs to a region, and so to no other column and row."""
        for spans_m, index, m in zip(self.spans_m, region, at_m, strict=True):
            _extend(spans_m, index, m)
            for other, span_m in spans_m.items():
                if other != index:
                    side = min if other < index else max
                    spans_m[other] = (side(span_m[0], m), side(span_m[1], m))

    def leave(self, region: Region, after: Region, at_m: _Vector) -> None:
        """Learn that a region extends to the border, where another was found to be entered.

        Nothing is learned where the border is not near: the goal is declared well inside it, and
        an estimate that jumps crosses no border.
        """
        for spans_m, i, j, m in zip(self.spans_m, region, after, at_m, strict=True):
            depth_m = abs(m - spans_m.get(j, (m, m))[i > j])
            if i == j or (abs(i - j) == 1 and depth_m <= BORDER_M):
                _extend(spans_m, i, m)


def _extend(spans_m: dict[int, _Vector], index: int, m: float) -> None:
    low_m, high_m = spans_m.get(index, (m, m))
    spans_m[index] = (min(low_m, m), max(high_m, m))


class PlanningLearner:
    """Learns the floor by driving, and plans on it, an action being as good as its worst end."""

    def __init__(self, setup: LearnerSetup) -> None:
        self._shape, self._gamma, self._rng = setup.shape, setup.config.gamma, setup.rng
        turns = 2.0 * math.pi * np.arange(setup.shape[2]) / setup.shape[2]
        self._directions = np.round([np.cos(turns), np.sin(turns)], 12).T.tolist()
        self._floor = Extents()
        self._walls: list[Wall] = []
        wall = (Rewards().bump, True)  # its reward until one is felt; whether the path ended
        self._entered: dict[_End, tuple[float, bool]] = {_WALL: wall}
        self._ends: dict[Region, list[set[_End]]] | None = None

    def choose(self, situation: Situation) -> int:
        """Return the action that promises most; of equal ones, that farthest from known walls."""
        at_m, ranks = (situation.x_m, situation.y_m), []
        self._cross(situation.region, at_m)
        best = max((one for one, _ in self._entered.values() if one > 0.0), default=Rewards().goal)
        values = {region: max(q) for region, q in self._plan(_OPTIMISM * best).items()}
        for direction in self._directions:
            end = self._imagine(situation.region, at_m, direction)
            worth = round(self._worth(end, values, _OPTIMISM * best), 9)
            ranks.append((worth, free_length_m(self._walls, at_m, direction), self._rng.random()))
        return ranks.index(max(ranks))

    def update(self, experience: Experience) -> None:
        """Add what was crossed, entered and felt to the model."""
        after, outcome = experience.after, experience.outcome
        end = _WALL if outcome is PathOutcome.BUMP else after.region
        self._entered[end] = (experience.reward, outcome is not None)
        if not after.certain:
            return
        at_m = (after.x_m, after.y_m)
        if outcome is not PathOutcome.BUMP:  # until the border it was in the region that it left
            self._floor.leave(experience.before.region, after.region, at_m)
        self._cross(after.region, at_m)
        if outcome is PathOutcome.BUMP:
            x, y = self._directions[experience.action]
            for azimuth in experience.touched_rad or (math.atan2(y, x),):
                self._walls = with_wall(self._walls, azimuth, at_m)

    def _cross(self, region: Region, at_m: _Vector) -> None:
        """Learn that a place is floor of a region, and that no wall lies before it."""
        self._floor.enter(region, at_m)
        self._entered.setdefault(region, (0.0, False))
        self._walls = [wall for wall in self._walls if wall.gap_m(at_m) > -_MARGIN_M]
        self._ends = None

    def _imagine(self, region: Region, at_m: _Vector, direction: _Vector) -> _End:
        """Return the end of an option: straight on to a wall, a border or the unknown."""
        edges = []
        for axis in (axis for axis in (0, 1) if direction[axis]):
            slope, spans_m = direction[axis], self._floor.spans_m[axis]
            step = 1 if slope > 0.0 else -1
            own_m = spans_m[region[axis]][slope > 0.0]
            next_m = spans_m.get(region[axis] + step, (math.inf, -math.inf))[slope < 0.0]
            known = abs(next_m - own_m) <= BORDER_M
            length_m = ((next_m if known else own_m) - at_m[axis]) / slope
            edges.append((max(0.0, length_m), axis, step if known else None))
        first_m = min(edges)[0]
        if free_length_m(self._walls, at_m, direction) <= first_m:
            return _WALL
        steps = {axis: step for length_m, axis, step in edges if length_m <= first_m + _TINY}
        if None in steps.values():
            return None
        return region[0] + (steps.get(0) or 0), region[1] + (steps.get(1) or 0)

    def _worth(self, end: _End, values: Mapping[Region, float], unknown: float) -> float:
        """Return r + gamma max_b Q(s', b) of an imagined end: equation (1) with alpha = 1."""
        if end is None or end not in self._entered:
            return unknown
        reward, ended = self._entered[end]
        next_q = () if ended else (values.get(end, 0.0),)
        return q_update(0.0, reward, next_q, alpha=1.0, gamma=self._gamma)

    def _plan(self, unknown: float) -> dict[Region, list[float]]:
        """Return Q-values of the known regions, by sweeps of equation (1) until none changes."""
        self._ends = self._ends or self._imagine_all()
        q: dict[Region, list[float]] = {}
        values = dict.fromkeys(self._ends, 0.0)
        for _ in range(1000):
            for region, actions in self._ends.items():
                q[region] = [min(self._worth(e, values, unknown) for e in a) for a in actions]
            before, values = values, {region: max(row) for region, row in q.items()}
            if values == before:
                break
        return q

    def _imagine_all(self) -> dict[Region, list[set[_End]]]:
        """Return the ends of each action of each known region, from points all over it."""
        points = (
            [(index, m) for index, span_m in one.items() for m in np.linspace(*span_m, _POINTS)]
            for one in self._floor.spans_m
        )
        ends: dict[Region, list[set[_End]]] = {}
        for (i, x_m), (j, y_m) in itertools.product(*points):
            if not self._entered.get((i, j), (0.0, False))[1]:
                found = ends.setdefault((i, j), [set() for _ in self._directions])
                for known, direction in zip(found, self._directions, strict=True):
                    known.add(self._imagine((i, j), (x_m, y_m), direction))
        return ends

    def policy(self) -> tuple[FloatArray, NDArray[np.int64]]:
        """Return the plan that takes the unknown for a wall; visited is what leads to a reward."""
        q, visits = np.zeros(self._shape), np.zeros(self._shape, dtype=np.int64)
        for region, values in self._plan(self._entered[_WALL][0]).items():
            q[region], visits[region] = values, int(max(values) > 0.0)
        return q, visits

    def save(self) -> Mapping[str, Any]:
        """Return the model."""
        spans, entered = [[*s.items()] for s in self._floor.spans_m], [*self._entered.items()]
        return {'spans_m': spans, 'walls': self._walls, 'entered': entered}

    def load(self, state: Mapping[str, Any]) -> None:
        """Continue with a model."""
        self._floor.spans_m = tuple({i: (a, b) for i, (a, b) in one} for one in state['spans_m'])
        self._walls = [Wall(*wall) for wall in state['walls']]
        self._entered |= {(i, j): (reward, ended) for (i, j), (reward, ended) in state['entered']}
