"""The region map of the paper's Fig. 1 and the knots of its Fig. 5, as one value.

The six knots of an axis are x0 <= x1 <= ... <= x5: the first set is full on [x0, x1], passes to
the second on [x1, x2], the second is full on [x2, x3], passes to the third on [x3, x4], the third
is full on [x4, x5]. A crisp border is the middle of its transition area, where both memberships
are one half; so crisp and fuzzy states agree on which region dominates.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
import itertools
import math
import re

from goalreach_msgs_py.angles import inches
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import Configuration, is_number, parameter
from goalreach_msgs_py.values import PathOutcome, Region

X_LABELS = ('LEFT-SIDE', 'FRONT', 'RIGHT-SIDE')
Y_LABELS = ('NEAR', 'MEDIUM', 'FAR')
GOAL_REGION: Region = (1, 0)
"""(FRONT, NEAR), fixed as the goal state in section "The State Set"."""

MOST_REGIONS = 9
"""Largest number of columns, and of rows."""
ACTION_COUNTS = (4, 8, 16)
"""Possible numbers of headings; 8 in the paper."""
_MOST_REWARD = 1e6
_LABEL = re.compile(r'[^\s,/<>&"]+( [^\s,/<>&"]+)*')

# Chosen, not from the paper (its figures have no numbers): borders at one third and two thirds of
# the arena (140 x 200 in), so that all regions are alike, and transition areas of 20 in, wide
# enough for headings to blend gently at 20 in/s and many times the error of the position estimate.
DEFAULT_X_KNOTS_M = tuple(map(inches, (0.0, 36.5, 56.5, 83.5, 103.5, 140.0)))
DEFAULT_Y_KNOTS_M = tuple(map(inches, (0.0, 56.5, 76.5, 123.5, 143.5, 200.0)))


def labels(shape: tuple[int, int]) -> list[tuple[str, ...]]:
    """Return the labels of columns and of rows: the paper's for three, else axis and number."""
    return [
        paper if count == len(paper) else tuple(f'{axis}{k}' for k in range(1, count + 1))
        for axis, paper, count in zip('XY', (X_LABELS, Y_LABELS), shape, strict=True)
    ]


def region_name(region: Region, shape: tuple[int, int] = (3, 3)) -> str:
    """Return a region as the paper writes it; `shape` is the numbers of columns and rows.

    >>> region_name((1, 0)), region_name((1, 0), (5, 3))
    ('FRONT/NEAR', 'X2/NEAR')
    """
    columns, rows = labels(shape)
    return f'{columns[region[0]]}/{rows[region[1]]}'


def parse_region(
    name: str,
    shape: tuple[int, int] | None = None,
    own: Sequence[tuple[str, ...]] = (),
    *,
    field: str = 'region',
) -> Region:
    """Return the region that `region_name` wrote; the shape is None where it is unknown.

    Own labels of columns and rows replace the usual ones; errors name the field.

    Raises:
        ConfigurationError: The text is not `X/Y` with such labels.
    """
    known_x, known_y = own or labels(shape or (MOST_REGIONS, MOST_REGIONS))
    if shape is None:
        known_x, known_y = (*X_LABELS, *known_x), (*Y_LABELS, *known_y)
    x_label, _, y_label = name.partition('/')
    if x_label not in known_x or y_label not in known_y:
        allowed = f'one of {"|".join(known_x)} / one of {"|".join(known_y)}'
        raise ConfigurationError(field, name, allowed)
    i, j = known_x.index(x_label), known_y.index(y_label)
    return (i, j) if shape else (i - 3 * (i > 2), j - 3 * (j > 2))  # noqa: PLR2004 - after the paper's three


@dataclass(frozen=True, kw_only=True)
class Rewards:
    """Reward of an action that ends a path: into the goal, a wall, a forbidden region; else 0.

    Raises:
        ConfigurationError: The goal's is not positive, or another's is.
    """

    goal: float = 1.0
    bump: float = -1.0
    forbidden: float = -1.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            low, high = (1e-6, _MOST_REWARD) if name == 'goal' else (-_MOST_REWARD, 0.0)
            if not is_number(value) or not low <= value <= high:
                allowed = f'a number in [{low:g}, {high:g}]'
                raise ConfigurationError(f'rewards.{name}', value, allowed)

    @classmethod
    def read(cls, value: object) -> 'Rewards':
        """Return the rewards of a document; one that is left out is the paper's."""
        known = vars(cls())
        if not isinstance(value, dict) or not known.keys() >= value.keys():
            raise ConfigurationError('rewards', value, f'a mapping of {", ".join(known)}')
        return cls(**value)

    def of(self, outcome: PathOutcome | None) -> float:
        """Return the reward; a time-out, which is not in the paper, brings none."""
        return 0.0 if outcome is None else float(getattr(self, outcome.value, 0.0))


@dataclass(frozen=True, kw_only=True)
class RegionMap:
    """The task: regions over the arena with transition areas, where paths end, and what it brings.

    Attributes:
        x_knots_m: x0 ... x5, ascending, metres in `map`; two for each column, of which the paper
            has three.
        y_knots_m: y0 ... y5, likewise.
        goal: Indices (i, j) of the goal region.
        actions: Number of headings to choose from.
        forbidden: Regions that end a path, too; not in the paper.
        rewards: Rewards of what ends a path.
        own_labels: Labels of columns and rows for people, if any; messages keep the usual ones.

    Raises:
        ConfigurationError: Knots that are not an even number of ascending finite numbers, no such
            goal or forbidden region, or labels that are not different texts, one for each.
    """

    x_knots_m: tuple[float, ...] = DEFAULT_X_KNOTS_M
    y_knots_m: tuple[float, ...] = DEFAULT_Y_KNOTS_M
    goal: Region = GOAL_REGION
    actions: int = 8
    forbidden: tuple[Region, ...] = ()
    rewards: Rewards = Rewards()
    own_labels: tuple[tuple[str, ...], ...] = ()

    def __post_init__(self) -> None:
        for name in ('x_knots_m', 'y_knots_m'):
            knots = getattr(self, name)
            good = len(knots) in range(2, 2 * MOST_REGIONS + 1, 2) and all(
                map(math.isfinite, knots)
            )
            if not good or any(b < a for a, b in itertools.pairwise(knots)):
                allowed = 'two ascending finite numbers for each of 1 to 9 regions'
                raise ConfigurationError(name, knots, allowed)
            if any(b <= a for a, b in itertools.pairwise(_borders(knots))):
                raise ConfigurationError(name, knots, 'knots that leave no region empty')
        columns, rows = self.shape
        if len(self.goal) != 2 or self.goal not in self.cells:  # noqa: PLR2004
            raise ConfigurationError(
                'goal', self.goal, f'two indices in 0..{columns - 1} and 0..{rows - 1}'
            )
        if type(self.actions) is not int or self.actions not in ACTION_COUNTS:
            raise ConfigurationError('actions', self.actions, '4, 8 or 16')
        for region in self.forbidden:
            if region not in self.cells or region == self.goal:
                raise ConfigurationError('forbidden', region, 'regions other than the goal')
        axes = [*map(len, self.own_labels)], [len({*axis}) for axis in self.own_labels]
        good = all(map(_LABEL.fullmatch, itertools.chain(*self.own_labels)))
        if self.own_labels and not (good and axes == ([columns, rows], [columns, rows])):
            allowed = f'{columns} and {rows} different texts without , / < > & "'
            raise ConfigurationError('labels', self.own_labels, allowed)

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of columns and rows."""
        return len(self.x_knots_m) // 2, len(self.y_knots_m) // 2

    @property
    def cells(self) -> list[Region]:
        """All regions, column by column."""
        return list(itertools.product(*map(range, self.shape)))  # type: ignore[arg-type]

    @property
    def labels(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Labels of the columns and of the rows."""
        x, y = self.own_labels or labels(self.shape)
        return x, y

    def name(self, region: Region) -> str:
        """Return a region by its labels."""
        pairs = zip(self.labels, region, strict=True)
        return '/'.join(names[k] if k < len(names) else str(k + 1) for names, k in pairs)

    @cached_property
    def ends(self) -> dict[Region, PathOutcome]:
        """The regions that end a path, and how."""
        forbidden = dict.fromkeys(self.forbidden, PathOutcome.FORBIDDEN)
        return {self.goal: PathOutcome.GOAL, **forbidden}

    @cached_property
    def x_borders_m(self) -> tuple[float, ...]:
        """The lines x that bound the columns, arena walls included, metres."""
        return _borders(self.x_knots_m)

    @cached_property
    def y_borders_m(self) -> tuple[float, ...]:
        """The lines y that bound the rows, arena walls included, metres."""
        return _borders(self.y_knots_m)

    @cached_property
    def _inner_borders_m(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        return self.x_borders_m[1:-1], self.y_borders_m[1:-1]

    def region_at(self, x_m: float, y_m: float) -> Region:
        """Return the region that holds a point; a border belongs to the larger index.

        Points outside the arena belong to the nearest region.
        """
        x_inner_m, y_inner_m = self._inner_borders_m
        return bisect_right(x_inner_m, x_m), bisect_right(y_inner_m, y_m)

    def memberships_at(
        self, x_m: float, y_m: float
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the memberships of a point: of x in the columns, of y in the rows."""
        return memberships(x_m, self.x_knots_m), memberships(y_m, self.y_knots_m)

    def bounds(self, region: Region) -> tuple[float, float, float, float]:
        """Return x_min, y_min, x_max, y_max of a region, metres."""
        i, j = region
        x_borders, y_borders = self.x_borders_m, self.y_borders_m
        return x_borders[i], y_borders[j], x_borders[i + 1], y_borders[j + 1]


def _borders(knots: tuple[float, ...]) -> tuple[float, ...]:
    inner = ((low + high) / 2 for low, high in zip(knots[1:-1:2], knots[2:-1:2], strict=True))
    return knots[0], *inner, knots[-1]


def memberships(value: float, knots: Sequence[float]) -> tuple[float, ...]:
    """Return the degree of membership of a value in each of the fuzzy sets of an axis.

    Fig. 5 of the paper: the first set is full on [k0, k1] and fades to the second on [k1, k2],
    the second is full on [k2, k3] and fades to the third on [k3, k4], and so on. Beyond the outer
    knots the nearest set is full.

    Returns:
        Memberships in [0, 1] whose sum is one; at most two are positive.

    >>> memberships(2.5, (0.0, 1.0, 3.0, 5.0, 7.0, 8.0))
    (0.25, 0.75, 0.0)
    """
    mu = [0.0] * (len(knots) // 2)
    index = bisect_right(knots[2:-1:2], value)
    low, high = knots[2 * index + 1], knots[min(2 * index + 2, len(knots) - 1)]
    if value <= low or index == len(mu) - 1:
        mu[index] = 1.0
    elif index == 0:
        mu[0] = (high - value) / (high - low)
        mu[1] = 1.0 - mu[0]
    else:
        mu[index + 1] = (value - low) / (high - low)
        mu[index] = 1.0 - mu[index + 1]
    return tuple(mu)


@dataclass(frozen=True, kw_only=True)
class RegionConfig(Configuration):
    """Knots, goal, forbidden regions and labels of a `RegionMap`."""

    x_knots_m: tuple[float, ...] = parameter(
        DEFAULT_X_KNOTS_M, 'Knots x0..x5 of LEFT-SIDE, FRONT, RIGHT-SIDE, m (Fig. 5a)'
    )
    y_knots_m: tuple[float, ...] = parameter(
        DEFAULT_Y_KNOTS_M, 'Knots y0..y5 of NEAR, MEDIUM, FAR, m (Fig. 5b)'
    )
    goal_region: str = parameter(region_name(GOAL_REGION), 'The goal state, as X/Y')
    forbidden_regions: str = parameter('', 'Regions not to be entered, as X/Y, with commas')
    labels: str = parameter('', 'Labels of the regions for people, as A,B,C/D,E,F; may be empty')

    def __post_init__(self) -> None:
        """Check every field and that they make a region map."""
        super().__post_init__()
        try:
            _ = self.region_map
        except ConfigurationError as error:
            field = {'goal': 'goal_region', 'forbidden': 'forbidden_regions'}.get(error.field)
            value = getattr(self, field) if field else error.value
            raise ConfigurationError(field or error.field, value, error.allowed) from None

    @property
    def region_map(self) -> RegionMap:
        """The region map that these parameters describe."""
        return RegionMap(
            x_knots_m=self.x_knots_m,
            y_knots_m=self.y_knots_m,
            goal=parse_region(self.goal_region, field='goal'),
            forbidden=tuple(
                parse_region(name.strip(), field='forbidden')
                for name in self.forbidden_regions.split(',')
                if name
            ),
            own_labels=tuple(tuple(a.split(',')) for a in self.labels.split('/') if a),
        )

    @classmethod
    def for_map(cls, regions: RegionMap) -> 'RegionConfig':
        """Return the parameters that describe a region map."""
        return cls(
            x_knots_m=regions.x_knots_m,
            y_knots_m=regions.y_knots_m,
            goal_region=region_name(regions.goal, regions.shape),
            forbidden_regions=','.join(region_name(r, regions.shape) for r in regions.forbidden),
            labels='/'.join(map(','.join, regions.own_labels)),
        )
