"""From memberships to a heading: the crisp choice and three ways to blend actions."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Final

from goalreach_learning.policy import Policy
from goalreach_learning.task import ACTION_DIRECTIONS, ACTIONS_DEG
from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Region

MODES: Final = ('crisp', 'fuzzy', 'fuzzy-eq3', 'fuzzy-as-printed')
"""One cell; products over four cells; equation (3) with unit vectors; equation (3) as printed."""

_OPPOSED: Final = 1e-6
"""Length of the blended unit vector below which its direction is meaningless; chosen."""


@dataclass(frozen=True, kw_only=True)
class Vote:
    """The contribution of one cell to the heading.

    Attributes:
        region: The cell.
        action: Its greedy action.
        weight: Its weight, > 0; not normalised.
    """

    region: Region
    action: int
    weight: float


def blend_heading(
    mode: str, mu_x: Sequence[float], mu_y: Sequence[float], policy: Policy
) -> float | None:
    """Return the heading to drive in a fuzzy state, radians in (-pi, pi].

    Args:
        mode: One of `MODES`.
        mu_x: Memberships (3,) of x.
        mu_y: Memberships (3,) of y.
        policy: Source of the greedy actions.

    Returns:
        The heading in `map`, or None if no cell votes or the votes cancel out.

    Raises:
        ConfigurationError: There is no such mode.
    """
    return blend(mode, votes(mode, mu_x, mu_y, policy))


def votes(
    mode: str, mu_x: Sequence[float], mu_y: Sequence[float], policy: Policy
) -> tuple[Vote, ...]:
    """Return the cells that vote and their weights.

    The goal and cells that were never visited have no learned action and do not vote. In `crisp`
    mode the cell with the largest weight among those that can vote does.

    Args:
        mode: One of `MODES`.
        mu_x: Memberships (3,) of x.
        mu_y: Memberships (3,) of y.
        policy: Source of the greedy actions.

    Raises:
        ConfigurationError: There is no such mode.
    """
    if mode == 'fuzzy':
        return _learned(_product_weights(mu_x, mu_y), policy)
    if mode in ('fuzzy-eq3', 'fuzzy-as-printed'):
        return _learned(_equation_3_weights(mu_x, mu_y), policy)
    if mode == 'crisp':
        found = _learned(_product_weights(mu_x, mu_y), policy)
        return (max(found, key=lambda vote: vote.weight),) if found else ()
    raise ConfigurationError('mode', mode, 'one of ' + ', '.join(MODES))


def _product_weights(mu_x: Sequence[float], mu_y: Sequence[float]) -> list[tuple[Region, float]]:
    """Return the product of the memberships of each cell, of which at most four are positive."""
    return [
        ((i, j), mu_x[i] * mu_y[j])
        for i in range(3)
        if mu_x[i] > 0.0
        for j in range(3)
        if mu_y[j] > 0.0
    ]


def _equation_3_weights(
    mu_x: Sequence[float], mu_y: Sequence[float]
) -> list[tuple[Region, float]]:
    """Return the weights of equation (3): the dominant cell and a neighbour along x and along y.

    a_i and a_(i+1) are the actions of adjacent columns in the dominant row j; a_j and a_(j+1)
    those of adjacent rows in the dominant column i: the dominant cell votes twice.
    """
    i, j = _dominant(mu_x), _dominant(mu_y)
    along_x = [((column, j), mu_x[column]) for column in range(3) if mu_x[column] > 0.0]
    along_y = [((i, row), mu_y[row]) for row in range(3) if mu_y[row] > 0.0]
    return along_x + along_y


def _dominant(mu: Sequence[float]) -> int:
    """Return the index of the largest membership, the larger one at a tie, as `region_at`."""
    return max(range(3), key=lambda k: (mu[k], k))


def _learned(weights: list[tuple[Region, float]], policy: Policy) -> tuple[Vote, ...]:
    actions = policy.actions
    return tuple(
        Vote(region=region, action=action, weight=weight)
        for region, weight in weights
        if (action := actions[region[0]][region[1]]) is not None
    )


def blend(mode: str, cast: Sequence[Vote]) -> float | None:
    """Return the weighted mean of the votes' headings, radians in (-pi, pi].

    Args:
        mode: `fuzzy-as-printed` averages the actions as numbers 0 ... 315, as equation (3) is
            printed; every other mode averages their unit vectors.
        cast: The votes.

    Returns:
        The heading in `map`, or None if there is no vote or the votes cancel out.
    """
    total = math.fsum(vote.weight for vote in cast)
    if total <= 0.0:
        return None
    if mode == 'fuzzy-as-printed':
        mean_deg = math.fsum(v.weight * ACTIONS_DEG[v.action] for v in cast) / total
        return wrap_angle(math.radians(mean_deg))
    x = math.fsum(vote.weight * ACTION_DIRECTIONS[vote.action][0] for vote in cast)
    y = math.fsum(vote.weight * ACTION_DIRECTIONS[vote.action][1] for vote in cast)
    if math.hypot(x, y) < _OPPOSED * total:
        return None
    return wrap_angle(math.atan2(y, x))
