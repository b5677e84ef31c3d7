"""Learned policies: Q-values, visits, and the greedy action of each region."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from goalreach_learning.task import ACTION_COUNT, ACTION_DIRECTIONS
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import FloatArray, Region

_SHAPE = (3, 3, ACTION_COUNT)
_DIRECTIONS = np.array(ACTION_DIRECTIONS)
_DECIMALS = 9

_TIE_FRACTION = 0.2
_DEFAULT_GAMMA = 0.9


def tie_tolerance(gamma: float = _DEFAULT_GAMMA) -> float:
    """Return the difference up to which two Q-values count as equal.

    A fifth (chosen) of 1 - gamma, the relative loss of value per action on the way to the goal:
    well below the difference of a detour by one action.

    Args:
        gamma: Discount factor with which the values were learned.
    """
    return _TIE_FRACTION * (1.0 - gamma)


def best_actions(q: FloatArray, visits: NDArray[np.int64], tolerance: float) -> NDArray[np.int64]:
    """Return the greedy action of every state, or -1 where none was tried.

    Often several adjacent headings are practically equal in value. The one closest to the mean of
    their directions is taken, the best at a tie, since it keeps away from walls and region borders
    on both sides.

    Args:
        q: Q-values (..., 8).
        visits: How often each action was tried, (..., 8); untried actions are never greedy.
        tolerance: Largest difference from the best value that counts as equal.

    Returns:
        Indices of actions, shape (...).
    """
    tried = visits > 0
    known = np.where(tried, q, -np.inf)
    equal = tried & (known >= known.max(axis=-1, keepdims=True) - tolerance)
    mean = equal @ _DIRECTIONS
    along = np.where(equal, np.round(mean @ _DIRECTIONS.T, _DECIMALS), -np.inf)
    middle = equal & (along == along.max(axis=-1, keepdims=True))
    best = np.where(middle, known, -np.inf).argmax(axis=-1)
    return np.where(tried.any(axis=-1), best, -1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Policy:
    """A learned policy over the nine regions.

    Attributes:
        q: Q-values (3, 3, 8), indexed [x][y][action].
        visits: Number of updates of each, same shape.
        regions: The region map, with its goal.
        learning: Parameters of the learning by name: alpha, gamma, temperatures, trials, seed, ...

    Raises:
        ConfigurationError: An array has the wrong shape or an invalid value.
    """

    q: FloatArray
    visits: NDArray[np.int64]
    regions: RegionMap
    learning: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        for name in ('q', 'visits'):
            array = getattr(self, name)
            if array.shape != _SHAPE:
                raise ConfigurationError(name, array.shape, f'an array of shape {_SHAPE}')
            if not np.isfinite(array).all():
                raise ConfigurationError(name, 'nan or inf', 'finite numbers')
        if (self.visits < 0).any():
            raise ConfigurationError('visits', int(self.visits.min()), 'whole numbers >= 0')
        self.q.setflags(write=False)
        self.visits.setflags(write=False)

    @classmethod
    def unlearned(cls, regions: RegionMap) -> 'Policy':
        """Return a policy without any learning: all Q-values and visits zero."""
        return cls(q=np.zeros(_SHAPE), visits=np.zeros(_SHAPE, dtype=np.int64), regions=regions)

    @cached_property
    def actions(self) -> tuple[tuple[int | None, ...], ...]:
        """The greedy action [x][y] of every region; None for the goal and where none was tried."""
        gamma = float(self.learning.get('gamma', _DEFAULT_GAMMA))
        best = best_actions(self.q, self.visits, tie_tolerance(gamma))
        best[self.regions.goal] = -1
        return tuple(tuple(None if k < 0 else k for k in column) for column in best.tolist())

    def greedy_action(self, region: Region) -> int | None:
        """Return the greedy action of a region, or None where none was learned.

        Args:
            region: The state (i, j).
        """
        return self.actions[region[0]][region[1]]
