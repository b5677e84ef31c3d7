"""`OptionEnvironment` for many robots at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from goalreach_learning.environment import OptionEnvironment
from goalreach_learning.task import ACTION_DIRECTIONS
from goalreach_msgs_py.values import FloatArray

IntArray = NDArray[np.int64]

_DIRECTIONS = np.array(ACTION_DIRECTIONS)
_SIGNS = np.sign(_DIRECTIONS).astype(np.int64)
_DIVISORS = np.where(_SIGNS == 0, 1.0, _DIRECTIONS)


class BatchEnd(NamedTuple):
    """Where n options ended: `OptionEnd` with arrays (n,)."""

    x_m: FloatArray
    y_m: FloatArray
    i: IntArray
    j: IntArray
    bumped: NDArray[np.bool_]
    length_m: FloatArray


class BatchEnvironment:
    """The same closed form as `OptionEnvironment`, number for number, on arrays.

    Args:
        environment: What to repeat n times.
    """

    def __init__(self, environment: OptionEnvironment) -> None:
        """Tabulate borders [region index][sign + 1] and contacts [sign + 1]."""
        self.regions = environment.regions
        self._overshoot_m = environment.overshoot_m
        x_inner, y_inner = self.regions.x_borders_m[1:3], self.regions.y_borders_m[1:3]
        self._x_inner, self._y_inner = x_inner, y_inner
        self._x_borders, self._y_borders = _border_table(x_inner), _border_table(y_inner)
        x_low, x_high = environment.x_contacts_m
        y_low, y_high = environment.y_contacts_m
        self._x_contacts = np.array([x_low, np.inf, x_high])
        self._y_contacts = np.array([y_low, np.inf, y_high])

    def advance(
        self, x_m: FloatArray, y_m: FloatArray, i: IntArray, j: IntArray, action: IntArray
    ) -> BatchEnd:
        """Return where one action of each robot leads.

        Args:
            x_m: Positions (n,) in `map`, metres.
            y_m: Positions (n,) in `map`, metres.
            i: Column of the region of each, (n,).
            j: Row of the region of each, (n,).
            action: Index of the action of each, (n,).
        """
        sign_x, sign_y = _SIGNS[action, 0], _SIGNS[action, 1]
        by_x, by_y = _DIVISORS[action, 0], _DIVISORS[action, 1]
        border_x = (self._x_borders[i, sign_x + 1] - x_m) / by_x
        border_y = (self._y_borders[j, sign_y + 1] - y_m) / by_y
        wall = np.minimum(
            (self._x_contacts[sign_x + 1] - x_m) / by_x,
            (self._y_contacts[sign_y + 1] - y_m) / by_y,
        )
        border = np.maximum(0.0, np.minimum(border_x, border_y))
        blocked = wall <= border
        i = np.where(~blocked & (border_x <= border), i + sign_x, i)
        j = np.where(~blocked & (border_y <= border), j + sign_y, j)
        goal = (i == self.regions.goal[0]) & (j == self.regions.goal[1]) & ~blocked
        overshoot_m = np.where(goal, 0.0, self._overshoot_m)
        length = np.where(blocked, np.maximum(0.0, wall), np.minimum(border + overshoot_m, wall))
        bumped = blocked | ((overshoot_m > 0.0) & (length >= wall))
        x_m = x_m + length * _DIRECTIONS[action, 0]
        y_m = y_m + length * _DIRECTIONS[action, 1]
        passed = ~blocked & (overshoot_m > 0.0)
        i = np.where(passed, _index(x_m, self._x_inner), i)
        j = np.where(passed, _index(y_m, self._y_inner), j)
        return BatchEnd(x_m, y_m, i, j, bumped, length)

    def regions_at(self, x_m: FloatArray, y_m: FloatArray) -> tuple[IntArray, IntArray]:
        """Return column and row of the region of every position, as `RegionMap.region_at`."""
        return _index(x_m, self._x_inner), _index(y_m, self._y_inner)


def _border_table(inner: tuple[float, ...]) -> FloatArray:
    first, second = inner
    return np.array([[-np.inf, np.inf, first], [first, np.inf, second], [second, np.inf, np.inf]])


def _index(value_m: FloatArray, inner: tuple[float, ...]) -> IntArray:
    return (value_m >= inner[0]).astype(np.int64) + (value_m >= inner[1])
