"""The arena: walls, LEDs, regions and starting positions, as one checked value."""

from collections.abc import Mapping
from dataclasses import dataclass, field
import itertools
import math
from typing import Any, Final

import numpy as np

from goalreach_msgs_py.angles import inches
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.obstacles import Obstacle, obstacles_from_flat
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.regions import RegionConfig, RegionMap
from goalreach_msgs_py.tags import FAMILIES, Tag, check_tags, tags_from_flat, tags_to_flat
from goalreach_msgs_py.values import FloatArray, Pose2

WIDTH_M = 3.556
"""140 in, section "The Simulation Phase"."""
LENGTH_M = 5.08
"""200 in, section "The Simulation Phase"."""

BODY_RADIUS_M = 0.225
"""Radius of the bumper ring as a driver author measured it (Player, drivers/mixed/nomad)."""

# Chosen: the paper names three LEDs but not their positions. The middle one is on a bracket 20 in
# in front of the goal wall and above the robot, since its depth has the strongest effect on
# accuracy (Cramer-Rao bound of the position: three times better than three LEDs in one plane).
_LANDMARKS_IN = ((35.0, 0.0, 56.0), (70.0, 20.0, 72.0), (105.0, 0.0, 64.0))
DEFAULT_LANDMARKS_M = tuple(tuple(map(inches, led)) for led in _LANDMARKS_IN)

PAPER_STARTS = 22
"""Starting positions of a trial, section "The Simulation Phase"."""

_BORDER_SAMPLES = 4000
_START_CLEARANCE_M = 0.1
FACING_GOAL_WALL_RAD = -math.pi / 2
_MINIMUM_LANDMARKS = 3
_LARGEST_M = 100.0
"""Longest side of an arena that the nodes accept. Chosen."""


def paper_starts(regions: RegionMap | None = None, count: int = PAPER_STARTS) -> tuple[Pose2, ...]:
    """Return starting poses at the borders of an arena, facing the goal wall.

    The paper has "22 different points at the borders of the environment" and no coordinates.
    Here they are spaced evenly along the rectangle 0.1 m inside the free floor, counter-clockwise
    from the goal wall, without the parts inside the goal and forbidden regions. The region map is
    the default one if None.
    """
    regions = regions or RegionMap()
    inset = BODY_RADIUS_M + _START_CLEARANCE_M
    right, far = regions.x_knots_m[-1] - inset, regions.y_knots_m[-1] - inset
    corners = np.array(
        [[inset, inset], [right, inset], [right, far], [inset, far], [inset, inset]]
    )
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(corners, axis=0)).sum(axis=1))])
    steps = np.linspace(0.0, along[-1], _BORDER_SAMPLES, endpoint=False)
    points = np.stack([np.interp(steps, along, corners[:, k]) for k in (0, 1)], axis=1)
    outside = np.array([regions.region_at(x, y) not in regions.ends for x, y in points])
    if not outside.any():
        allowed = '0: goal and forbidden regions cover the border'
        raise ConfigurationError('starts.border', count, allowed)
    rising = np.flatnonzero(outside & ~np.roll(outside, 1))
    begin = -int(rising[-1]) if len(rising) else 0  # after the goal region, if a wall has it
    points = np.roll(points, begin, axis=0)[np.roll(outside, begin)]
    chosen = points[((np.arange(count) + 0.5) * len(points) / count).astype(int)]
    return tuple(
        Pose2(x_m=float(x), y_m=float(y), heading_rad=FACING_GOAL_WALL_RAD)
        for x, y in chosen.round(4)
    )


def check_size(name: str, size_m: float) -> None:
    """Check the length of a side.

    Raises:
        ConfigurationError: It is too short for a robot to drive, or not a number.
    """
    if not 4 * BODY_RADIUS_M < size_m <= _LARGEST_M:
        allowed = f'more than {4 * BODY_RADIUS_M:g} m, at most {_LARGEST_M:g} m'
        raise ConfigurationError(name, size_m, allowed)


@dataclass(frozen=True, kw_only=True)
class Arena:
    """A closed rectangular floor with LEDs, regions and starting poses.

    Attributes:
        width_m: Size along x; the walls are x = 0 and x = width.
        length_m: Size along y; the goal wall is y = 0.
        landmarks_m: (x, y, z) of each LED in `map`; may be empty where there are tags.
        regions: The region map; its outer knots are the walls.
        starts: Poses from which paths begin.
        obstacles: Obstacles, at the start of their tracks.
        sonar: Whether the robot has its sonar even without obstacles.
        name: Name for people.
        tags: AprilTags.
        tag_family: Their family.

    Raises:
        ConfigurationError: A field is impossible or contradicts another; the line names it.
    """

    width_m: float = WIDTH_M
    length_m: float = LENGTH_M
    landmarks_m: tuple[tuple[float, ...], ...] = DEFAULT_LANDMARKS_M
    regions: RegionMap = field(default_factory=RegionMap)
    starts: tuple[Pose2, ...] = field(default_factory=paper_starts)
    obstacles: tuple[Obstacle, ...] = ()
    sonar: bool = False
    name: str = 'paper'
    tags: tuple[Tag, ...] = ()
    tag_family: str = '36h11'

    def __post_init__(self) -> None:
        for name in ('width_m', 'length_m'):
            check_size(name, getattr(self, name))
        check_tags(self.tags, self.tag_family)
        self._check_landmarks()
        self._check_regions()
        for index, start in enumerate(self.starts):
            if not self.is_free(start.x_m, start.y_m):
                point = (start.x_m, start.y_m)
                raise ConfigurationError(f'starts[{index}]', point, 'on the free floor')
            if (region := self.regions.region_at(start.x_m, start.y_m)) in self.regions.forbidden:
                name = self.regions.name(region)
                raise ConfigurationError(f'starts[{index}]', name, 'no forbidden region')
            if not math.isfinite(start.heading_rad):
                raise ConfigurationError(
                    f'starts[{index}].heading_rad', start.heading_rad, 'finite'
                )

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any]) -> 'Arena':
        """Return the arena that `ARENA_PARAMETERS` of `nomad200` describe, without starts.

        Raises:
            ConfigurationError: A parameter is missing, or they do not fit one another.
        """
        try:
            leds = iter(values['landmarks_m'] if values.get('leds', True) else ())
            regions = RegionConfig(
                x_knots_m=tuple(values['x_knots_m']),
                y_knots_m=tuple(values['y_knots_m']),
                goal_region=values['goal_region'],
                **{name: values.get(name) or '' for name in ARENA_PARAMETERS[-2:]},
            )
            return cls(
                width_m=values['arena_width_m'],
                length_m=values['arena_length_m'],
                landmarks_m=tuple(zip(leds, leds, leds, strict=True)),
                regions=regions.region_map,
                starts=(),
                obstacles=obstacles_from_flat(values.get('obstacles') or ()),
                tags=tags_from_flat(values.get('tags') or ()),
                tag_family=values.get('tag_family') or '36h11',
            )
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise ConfigurationError('arena', error, 'described by all its parameters') from None

    def _check_landmarks(self) -> None:
        if len(self.landmarks_m) < _MINIMUM_LANDMARKS and not self.tags:
            raise ConfigurationError('landmarks_m', self.landmarks_m, 'at least three LEDs')
        for index, led in enumerate(self.landmarks_m):
            if not self._holds(led):
                raise ConfigurationError(f'landmarks_m[{index}]', led, 'x, y, z in the arena')
        for index, tag in enumerate(self.tags):
            if not self._holds(place := (tag.x_m, tag.y_m, tag.z_m)):
                raise ConfigurationError(f'tags[{index}]', place, 'x, y, z in the arena')
        for index, led in enumerate(self.landmarks_m):
            if led in self.landmarks_m[:index]:
                raise ConfigurationError(f'landmarks_m[{index}]', led, 'apart from the others')

    def _holds(self, place: tuple[float, ...]) -> bool:
        most = (self.width_m, self.length_m, _LARGEST_M)
        inside = [0.0 <= at <= end for at, end in zip(place, most, strict=False)]
        return len(place) == len(most) and all(inside) and place[-1] > 0.0

    def _check_regions(self) -> None:
        outer = (
            ('x_knots_m', self.regions.x_knots_m, self.width_m),
            ('y_knots_m', self.regions.y_knots_m, self.length_m),
        )
        for name, knots, size in outer:
            if abs(knots[0]) > 1e-6 or abs(knots[-1] - size) > 1e-6:  # noqa: PLR2004 - one um
                raise ConfigurationError(name, knots, f'knots that cover 0 to {size:g} m')
        x_low, y_low, x_high, y_high = self.regions.bounds(self.regions.goal)
        low = BODY_RADIUS_M
        right, far = self.width_m - low, self.length_m - low
        if max(x_low, low) >= min(x_high, right) or max(y_low, low) >= min(y_high, far):
            name = self.regions.name(self.regions.goal)
            raise ConfigurationError('goal', name, 'a region that the robot can enter')

    def is_free(self, x_m: float, y_m: float, *, body_radius_m: float = BODY_RADIUS_M) -> bool:
        """Return whether a robot centred there touches no wall, and no obstacle at its start."""
        return (
            body_radius_m <= x_m <= self.width_m - body_radius_m
            and body_radius_m <= y_m <= self.length_m - body_radius_m
            and all(one.contact(x_m, y_m)[0] >= body_radius_m for one in self.obstacles)
        )


@dataclass(frozen=True, kw_only=True)
class ArenaConfig(Configuration):
    """Walls and landmarks of an arena as parameters."""

    arena_width_m: float = parameter(
        WIDTH_M, 'Arena size along x, m; the paper: 140 in', within=(0.5, 100.0)
    )
    arena_length_m: float = parameter(
        LENGTH_M, 'Arena size along y, m; the paper: 200 in', within=(0.5, 100.0)
    )
    landmarks_m: tuple[float, ...] = parameter(
        tuple(itertools.chain.from_iterable(DEFAULT_LANDMARKS_M)),
        'Surveyed positions of the LEDs in `map`, m: x, y, z of each in turn',
        within=(-100.0, 100.0),
    )
    leds: bool = parameter(True, 'Whether there are LEDs; off where tags are the only landmarks')
    tags: tuple[float, ...] = parameter(
        (),
        'AprilTags: number, side of the black square (m), centre in `map` (x, y, z, m) and '
        'direction in which it faces (rad) of each',
        within=(-1e4, 1e4),
    )
    tag_family: str = parameter('36h11', 'Family of the tags', choices=tuple(FAMILIES))

    def __post_init__(self) -> None:
        """Check every field, the tags, and that the coordinates are triples."""
        super().__post_init__()
        check_tags(self.tag_list, self.tag_family)
        if len(self.landmarks_m) % 3:
            raise ConfigurationError('landmarks_m', self.landmarks_m, 'x, y, z of each LED')

    @staticmethod
    def of_arena(arena: Arena) -> dict[str, Any]:
        """Return the values of these parameters for an arena."""
        return {
            'arena_width_m': arena.width_m,
            'arena_length_m': arena.length_m,
            'landmarks_m': tuple(itertools.chain.from_iterable(arena.landmarks_m)),
            'leds': bool(arena.landmarks_m),
            'tags': tags_to_flat(arena.tags),
            'tag_family': arena.tag_family,
        }

    @property
    def tag_list(self) -> tuple[Tag, ...]:
        """The tags."""
        return tags_from_flat(self.tags)

    @property
    def landmark_array_m(self) -> FloatArray:
        """The surveyed LEDs, (n, 3), metres in `map`."""
        return np.array(self.landmarks_m if self.leds else (), dtype=np.float64).reshape(-1, 3)


ARENA_PARAMETERS: Final = (
    *ArenaConfig.__dataclass_fields__,
    *('x_knots_m', 'y_knots_m', 'goal_region', 'obstacles', 'forbidden_regions', 'labels'),
)
"""Parameters of `nomad200` that describe its arena."""
