"""The region map of the paper's Fig. 1 and the knots of its Fig. 5, as one value.

The six knots of an axis are x0 <= x1 <= ... <= x5: the first set is full on [x0, x1], passes to
the second on [x1, x2], the second is full on [x2, x3], passes to the third on [x3, x4], the third
is full on [x4, x5]. A crisp border is the middle of its transition area, where both memberships
are one half; so crisp and fuzzy states agree on which region dominates.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import itertools
import math

from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import Region

X_LABELS = ('LEFT-SIDE', 'FRONT', 'RIGHT-SIDE')
Y_LABELS = ('NEAR', 'MEDIUM', 'FAR')
GOAL_REGION: Region = (1, 0)
"""(FRONT, NEAR), fixed as the goal state in section "The State Set"."""

_KNOTS = 6

# Chosen, not from the paper (its figures have no numbers): borders at one third and two thirds of
# the arena (140 x 200 in), so that all regions are alike, and transition areas of 20 in, wide
# enough for headings to blend gently at 20 in/s and many times the error of the position estimate.
_X_KNOTS_IN = (0.0, 36.5, 56.5, 83.5, 103.5, 140.0)
_Y_KNOTS_IN = (0.0, 56.5, 76.5, 123.5, 143.5, 200.0)
DEFAULT_X_KNOTS_M = tuple(round(k * INCH_M, 6) for k in _X_KNOTS_IN)
DEFAULT_Y_KNOTS_M = tuple(round(k * INCH_M, 6) for k in _Y_KNOTS_IN)


def region_name(region: Region) -> str:
    """Return a region as the paper writes it.

    >>> region_name((1, 0))
    'FRONT/NEAR'
    """
    return f'{X_LABELS[region[0]]}/{Y_LABELS[region[1]]}'


def parse_region(name: str) -> Region:
    """Return the region that `region_name` wrote.

    Raises:
        ConfigurationError: The text is not `X/Y` with the paper's labels.
    """
    x_label, _, y_label = name.partition('/')
    if x_label not in X_LABELS or y_label not in Y_LABELS:
        allowed = f'one of {"|".join(X_LABELS)} / one of {"|".join(Y_LABELS)}'
        raise ConfigurationError('region', name, allowed)
    return X_LABELS.index(x_label), Y_LABELS.index(y_label)


@dataclass(frozen=True, kw_only=True)
class RegionMap:
    """Nine regions over the arena, with transition areas and a goal.

    Attributes:
        x_knots_m: x0 ... x5, ascending, metres in `map`.
        y_knots_m: y0 ... y5, ascending, metres in `map`.
        goal: Indices (i, j) of the goal region.

    Raises:
        ConfigurationError: Knots that are not six ascending finite numbers, or no such goal.
    """

    x_knots_m: tuple[float, ...] = DEFAULT_X_KNOTS_M
    y_knots_m: tuple[float, ...] = DEFAULT_Y_KNOTS_M
    goal: Region = GOAL_REGION

    def __post_init__(self) -> None:
        for name in ('x_knots_m', 'y_knots_m'):
            knots = getattr(self, name)
            finite = len(knots) == _KNOTS and all(math.isfinite(k) for k in knots)
            if not finite or any(b < a for a, b in itertools.pairwise(knots)):
                raise ConfigurationError(name, knots, 'six ascending finite numbers')
            if not knots[0] < (knots[1] + knots[2]) / 2 < (knots[3] + knots[4]) / 2 < knots[5]:
                raise ConfigurationError(name, knots, 'knots that leave no region empty')
        if len(self.goal) != 2 or not all(0 <= index <= 2 for index in self.goal):  # noqa: PLR2004
            raise ConfigurationError('goal', self.goal, 'two indices in 0..2')

    @property
    def x_borders_m(self) -> tuple[float, float, float, float]:
        """The four lines x that bound the three columns, arena walls included, metres."""
        return _borders(self.x_knots_m)

    @property
    def y_borders_m(self) -> tuple[float, float, float, float]:
        """The four lines y that bound the three rows, arena walls included, metres."""
        return _borders(self.y_knots_m)

    def region_at(self, x_m: float, y_m: float) -> Region:
        """Return the region that holds a point; a border belongs to the larger index.

        Points outside the arena belong to the nearest region.
        """
        x_borders, y_borders = self.x_borders_m, self.y_borders_m
        return (
            int(x_m >= x_borders[1]) + int(x_m >= x_borders[2]),
            int(y_m >= y_borders[1]) + int(y_m >= y_borders[2]),
        )

    def memberships_at(
        self, x_m: float, y_m: float
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Return the memberships of a point: of x in the columns, of y in the rows."""
        return memberships(x_m, self.x_knots_m), memberships(y_m, self.y_knots_m)

    def bounds(self, region: Region) -> tuple[float, float, float, float]:
        """Return x_min, y_min, x_max, y_max of a region, metres."""
        i, j = region
        x_borders, y_borders = self.x_borders_m, self.y_borders_m
        return x_borders[i], y_borders[j], x_borders[i + 1], y_borders[j + 1]


def _borders(knots: tuple[float, ...]) -> tuple[float, float, float, float]:
    return knots[0], (knots[1] + knots[2]) / 2, (knots[3] + knots[4]) / 2, knots[5]


def memberships(value: float, knots: Sequence[float]) -> tuple[float, float, float]:
    """Return the degree of membership of a value in each of three fuzzy sets.

    Fig. 5 of the paper: the first set is full on [k0, k1] and fades to the second on [k1, k2],
    the second is full on [k2, k3] and fades to the third on [k3, k4], the third is full on
    [k4, k5]. Beyond the outer knots the nearest set is full.

    Args:
        value: Position along the axis, in the unit of the knots.
        knots: Six ascending numbers.

    Returns:
        Memberships in [0, 1] whose sum is one; at most two are positive.

    >>> memberships(2.5, (0.0, 1.0, 3.0, 5.0, 7.0, 8.0))
    (0.25, 0.75, 0.0)
    """
    _, k1, k2, k3, k4, _ = knots
    if value < k2:
        first = 1.0 if value <= k1 else (k2 - value) / (k2 - k1)
        return first, 1.0 - first, 0.0
    if value > k3:
        third = 1.0 if value >= k4 else (value - k3) / (k4 - k3)
        return 0.0, 1.0 - third, third
    return 0.0, 1.0, 0.0


@dataclass(frozen=True, kw_only=True)
class RegionConfig(Configuration):
    """Knots and goal of a `RegionMap`."""

    x_knots_m: tuple[float, ...] = parameter(
        DEFAULT_X_KNOTS_M, 'Knots x0..x5 of LEFT-SIDE, FRONT, RIGHT-SIDE, m (Fig. 5a)', length=6
    )
    y_knots_m: tuple[float, ...] = parameter(
        DEFAULT_Y_KNOTS_M, 'Knots y0..y5 of NEAR, MEDIUM, FAR, m (Fig. 5b)', length=6
    )
    goal_region: str = parameter(region_name(GOAL_REGION), 'The goal state, as X/Y')

    def __post_init__(self) -> None:
        """Check every field and that they make a region map."""
        super().__post_init__()
        try:
            _ = self.region_map
        except ConfigurationError as error:
            field = 'goal_region' if error.field == 'region' else error.field
            raise ConfigurationError(field, error.value, error.allowed) from None

    @property
    def region_map(self) -> RegionMap:
        """The region map that these parameters describe."""
        return RegionMap(
            x_knots_m=self.x_knots_m, y_knots_m=self.y_knots_m, goal=parse_region(self.goal_region)
        )

    @classmethod
    def for_map(cls, regions: RegionMap) -> 'RegionConfig':
        """Return the parameters that describe a region map."""
        return cls(
            x_knots_m=regions.x_knots_m,
            y_knots_m=regions.y_knots_m,
            goal_region=region_name(regions.goal),
        )
