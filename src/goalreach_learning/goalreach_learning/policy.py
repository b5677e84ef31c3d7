"""What was learned: Q-values, visits, and the best action of each region."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from goalreach_learning.actions import ACTION_COUNT, ACTION_DIRECTIONS
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import FloatArray, Region

__all__ = ['Policy', 'best_action']

_SHAPE = (3, 3, ACTION_COUNT)

TIE_TOLERANCE = 0.02
"""Values this near the best count as equally good; chosen: less than a tenth of the step from
one distance to the next, 1 - gamma = 0.1, that separates really different actions."""


def best_action(
    q: FloatArray, visits: NDArray[np.int64], tolerance: float = TIE_TOLERANCE
) -> int | None:
    """Return the best action of one state, or None where none was ever tried.

    Among actions of practically equal value (several headings lead on equally well) the one in
    the middle of them is taken: nearest to the mean of their directions, the best at a tie. It
    keeps away from walls and from region borders on both sides, where the outer ones do not.

    Args:
        q: Q-values (8,).
        visits: How often each action was tried, (8,); untried ones are not known, so not best.
        tolerance: Largest difference from the best that counts as equal.
    """
    tried = np.flatnonzero(visits > 0)
    if not len(tried):
        return None
    best = float(q[tried].max())
    equal = [int(k) for k in tried if q[k] >= best - tolerance]
    mean_x = math.fsum(ACTION_DIRECTIONS[k][0] for k in equal)
    mean_y = math.fsum(ACTION_DIRECTIONS[k][1] for k in equal)

    def preference(k: int) -> tuple[float, float]:
        along = ACTION_DIRECTIONS[k][0] * mean_x + ACTION_DIRECTIONS[k][1] * mean_y
        return round(along, 9), float(q[k])

    return max(equal, key=preference)


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
        return tuple(
            tuple(
                None
                if (i, j) == self.regions.goal
                else best_action(self.q[i, j], self.visits[i, j])
                for j in range(3)
            )
            for i in range(3)
        )

    def greedy_action(self, region: Region) -> int | None:
        """Return the best action of a region, or None where none was learned.

        Args:
            region: The state (i, j).
        """
        return self.actions[region[0]][region[1]]
