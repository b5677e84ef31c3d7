"""The action set, and learned policies: Q-values, visits, the greedy action of each region."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
import itertools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import ACTION_COUNTS, RegionMap
from goalreach_msgs_py.values import FloatArray, Region

_DECIMALS = 9
_TIE_FRACTION = 0.2
"""Of 1 - gamma, the relative loss of value per action on the way to the goal: up to this, times
the goal's reward, two Q-values count as equal. Chosen, well below a detour by one action."""
_DEFAULT_GAMMA = 0.9


@lru_cache
def action_directions(count: int) -> tuple[tuple[float, float], ...]:
    """Return the unit vectors (x, y) of evenly spaced headings, with exact zeros along the axes.

    Action k of a count that is a multiple of four has the heading k * 2 pi / count.
    """
    turns = [2.0 * math.pi * k / count for k in range(count // 4)]
    quadrants = [[(math.cos(t), math.cos(math.pi / 2 - t) if t else 0.0) for t in turns]]
    for _ in range(3):
        quadrants.append([(-y if y else 0.0, x) for x, y in quadrants[-1]])
    return tuple(itertools.chain.from_iterable(quadrants))


@lru_cache
def action_headings_rad(count: int) -> tuple[float, ...]:
    """Return the headings of the actions in `map`, radians in (-pi, pi]."""
    return tuple(wrap_angle(math.radians(360.0 / count * k)) for k in range(count))


def nearest_action(heading_rad: float, count: int) -> int:
    """Return the index of the action whose heading, radians in `map`, is nearest.

    >>> nearest_action(0.8, 8)
    1
    """
    return round(heading_rad * count / math.tau) % count


def best_actions(q: FloatArray, visits: NDArray[np.int64], tolerance: float) -> NDArray[np.int64]:
    """Return the greedy action of every state (...), or -1 where none was tried.

    Often several adjacent headings are practically equal in value. The one closest to the mean of
    their directions is taken, the best at a tie, since it keeps away from walls and region borders
    on both sides. Q-values and visits are (..., a) of a actions; values closer to the best one
    than the tolerance are equal, untried actions are never greedy.
    """
    tried, directions = visits > 0, np.array(action_directions(q.shape[-1]))
    known = np.where(tried, q, -np.inf)
    equal = tried & (known >= known.max(axis=-1, keepdims=True) - tolerance)
    mean = equal @ directions
    along = np.where(equal, np.round(mean @ directions.T, _DECIMALS), -np.inf)
    middle = equal & (along == along.max(axis=-1, keepdims=True))
    best = np.where(middle, known, -np.inf).argmax(axis=-1)
    return np.where(tried.any(axis=-1), best, -1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Policy:
    """A learned policy over the regions.

    Attributes:
        q: Q-values (columns, rows, actions), in the paper (3, 3, 8).
        visits: Number of updates of each, same shape.
        learning: Parameters of the learning by name: alpha, gamma, temperatures, trials, seed, ...
        learner: Name and state of the learner to continue with; empty for the paper's.

    Raises:
        ConfigurationError: An array has the wrong shape or an invalid value.
    """

    q: FloatArray
    visits: NDArray[np.int64]
    regions: RegionMap
    learning: Mapping[str, Any] = field(default_factory=dict)
    learner: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        shape = (*self.regions.shape, self.regions.actions)
        for name in ('q', 'visits'):
            array = getattr(self, name)
            if array.shape != shape:
                raise ConfigurationError(name, array.shape, f'an array of shape {shape}')
            if not np.isfinite(array).all():
                raise ConfigurationError(name, 'nan or inf', 'finite numbers')
        if (self.visits < 0).any():
            raise ConfigurationError('visits', int(self.visits.min()), 'whole numbers >= 0')
        self.q.setflags(write=False)
        self.visits.setflags(write=False)

    @classmethod
    def unlearned(cls, regions: RegionMap) -> 'Policy':
        """Return a policy without any learning: all Q-values and visits zero."""
        shape = (*regions.shape, regions.actions)
        return cls(q=np.zeros(shape), visits=np.zeros(shape, dtype=np.int64), regions=regions)

    @classmethod
    def of_table(cls, q: FloatArray, regions: RegionMap) -> 'Policy | None':
        """Return the policy of Q-values alone, of any number of actions; None if they do not fit.

        An action whose value is not exactly zero counts as tried.
        """
        if q.shape[:2] != regions.shape or q.shape[2] not in ACTION_COUNTS:
            return None
        regions = replace(regions, actions=q.shape[2])
        return cls(q=q, visits=(q != 0).astype(np.int64), regions=regions)

    @cached_property
    def actions(self) -> tuple[tuple[int | None, ...], ...]:
        """The greedy action [x][y] of every region; None for the goal and where none was tried."""
        loss = 1.0 - float(self.learning.get('gamma', _DEFAULT_GAMMA))
        tolerance = _TIE_FRACTION * loss * self.regions.rewards.goal
        best = best_actions(self.q, self.visits, tolerance)
        best[self.regions.goal] = -1
        return tuple(tuple(None if k < 0 else k for k in column) for column in best.tolist())

    def greedy_action(self, region: Region) -> int | None:
        """Return the greedy action of a region (i, j), or None where none was learned."""
        return self.actions[region[0]][region[1]]
