"""What was learned: Q-values, visits, and the best action of each region."""

from __future__ import annotations

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
    """Return how near to the best a value must be to count as equally good.

    A fifth (chosen) of 1 - gamma, the loss of value from one action to the next on the way from
    the goal: well below what tells really different actions apart.

    Args:
        gamma: Discount factor that the values were learned with.
    """
    return _TIE_FRACTION * (1.0 - gamma)


def best_actions(q: FloatArray, visits: NDArray[np.int64], tolerance: float) -> NDArray[np.int64]:
    """Return the best action of every state, or -1 where none was ever tried.

    Among actions of practically equal value (several headings lead on equally well) the one in
    the middle of them is taken: nearest to the mean of their directions, the best at a tie. It
    keeps away from walls and from region borders on both sides, where the outer ones do not.

    Args:
        q: Q-values (..., 8).
        visits: How often each action was tried, (..., 8); untried ones are not known, so not best.
        tolerance: Largest difference from the best that counts as equal.

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
        visits: How often each was updated, same shape.
        regions: The region map it was learned on; it names the goal.
        learning: How it was learned: alpha, gamma, temperatures, trials, seed, ... by name.

    Raises:
        ConfigurationError: An array has the wrong shape or a value that cannot be.
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
    def unlearned(cls, regions: RegionMap) -> Policy:
        """Return the policy of a robot that knows nothing yet: zeros."""
        return cls(q=np.zeros(_SHAPE), visits=np.zeros(_SHAPE, dtype=np.int64), regions=regions)

    @cached_property
    def actions(self) -> tuple[tuple[int | None, ...], ...]:
        """The best action [x][y] of every region; None for the goal and where never tried."""
        gamma = float(self.learning.get('gamma', _DEFAULT_GAMMA))
        best = best_actions(self.q, self.visits, tie_tolerance(gamma))
        best[self.regions.goal] = -1
        return tuple(tuple(None if k < 0 else k for k in column) for column in best.tolist())

    def greedy_action(self, region: Region) -> int | None:
        """Return the best action of a region, or None where none was learned.

        Args:
            region: The state (i, j).
        """
        return self.actions[region[0]][region[1]]
