"""From memberships to a heading: the crisp choice and three ways to blend actions."""

from collections.abc import Sequence
import math
from typing import Final, NamedTuple

from goalreach_learning.policy import Policy, action_directions
from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import Region

MODES: Final = ('crisp', 'fuzzy', 'fuzzy-eq3', 'fuzzy-as-printed')
"""One cell; products over four cells; equation (3) with unit vectors; equation (3) as printed."""

_OPPOSED: Final = 1e-6
"""Length of the blended unit vector below which its direction is meaningless; chosen."""


class Vote(NamedTuple):
    """The contribution of one cell to the heading.

    Its greedy action, out of a number of actions, has a weight > 0, not normalised.
    """

    region: Region
    action: int
    weight: float
    actions: int


def blend_heading(
    mode: str, mu_x: Sequence[float], mu_y: Sequence[float], policy: Policy
) -> float | None:
    """Return the heading to drive in a fuzzy state, radians in (-pi, pi].

    Args:
        mode: One of `MODES`.
        mu_x: Memberships of x.
        mu_y: Memberships of y.
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
    """Return the cells that vote and their weights, for the arguments of `blend_heading`.

    The goal and cells that were never visited have no learned action and do not vote. In `crisp`
    mode the cell with the largest weight among those that can vote does.

    Raises:
        ConfigurationError: There is no such mode.
    """
    if mode not in MODES:
        raise ConfigurationError('mode', mode, 'one of ' + ', '.join(MODES))
    weigh = _equation_3_weights if mode in MODES[2:] else _product_weights
    actions, count = policy.actions, policy.regions.actions
    cast = tuple(
        Vote((i, j), action, weight, count)
        for (i, j), weight in weigh(mu_x, mu_y)
        if (action := actions[i][j]) is not None
    )
    return (max(cast, key=lambda vote: vote.weight),) if cast and mode == 'crisp' else cast


def _product_weights(mu_x: Sequence[float], mu_y: Sequence[float]) -> list[tuple[Region, float]]:
    """Return the product of the memberships of each cell, of which at most four are positive."""
    return [((i, j), mu_x[i] * mu_y[j]) for i in _positive(mu_x) for j in _positive(mu_y)]


def _equation_3_weights(
    mu_x: Sequence[float], mu_y: Sequence[float]
) -> list[tuple[Region, float]]:
    """Return the weights of equation (3): the dominant cell and a neighbour along x and along y.

    In which row or column actions are taken the paper leaves open. Here a_i and a_(i+1) are of
    adjacent columns in the dominant row, a_j and a_(j+1) of adjacent rows in the dominant column:
    the dominant cell votes twice. Of equal memberships the larger index dominates (`region_at`).
    """
    i, j = (max(range(len(mu)), key=lambda k: (mu[k], k)) for mu in (mu_x, mu_y))
    along_x = [((column, j), mu_x[column]) for column in _positive(mu_x)]
    return along_x + [((i, row), mu_y[row]) for row in _positive(mu_y)]


def _positive(mu: Sequence[float]) -> list[int]:
    return [k for k, membership in enumerate(mu) if membership > 0.0]


def blend(mode: str, cast: Sequence[Vote]) -> float | None:
    """Return the weighted mean of the votes' headings, in `map`, radians in (-pi, pi].

    `fuzzy-as-printed` averages the actions as numbers 0 ... 315, as equation (3) is printed; every
    other mode averages their unit vectors. None if there is no vote or the votes cancel out.
    """
    total = math.fsum(vote.weight for vote in cast)
    if total <= 0.0:
        return None
    if mode == 'fuzzy-as-printed':
        mean_deg = math.fsum(v.weight * (360.0 / v.actions * v.action) for v in cast) / total
        return wrap_angle(math.radians(mean_deg))
    parts = [(vote.weight, *action_directions(vote.actions)[vote.action]) for vote in cast]
    x = math.fsum(weight * x for weight, x, _ in parts)
    y = math.fsum(weight * y for weight, _, y in parts)
    if math.hypot(x, y) < _OPPOSED * total:
        return None
    return wrap_angle(math.atan2(y, x))
