"""Arenas in YAML: size, LEDs, regions, goal and starting poses of an `Arena`.

    name: narrow
    width_m: 2.2
    length_m: 5.08
    leds_m:                 # x, y, z of each LED in `map`; at least three
      - [0.55, 0.0, 1.42]
      - [1.10, 0.5, 1.83]
      - [1.65, 0.0, 1.63]
    regions:
      x_borders_m: [0.75, 1.45]       # between LEFT-SIDE, FRONT and RIGHT-SIDE
      y_borders_m: [1.7, 3.4]         # between NEAR, MEDIUM and FAR
      transition_width_m: 0.4         # of the area around each border
      goal: FRONT/NEAR
      # optional, with the paper's values as defaults:
      actions: 8                      # 4, 8 or 16 headings
      labels: {x: [LEFT-SIDE, FRONT, RIGHT-SIDE], y: [NEAR, MEDIUM, FAR]}
      forbidden: []                   # regions that end a path, such as [LEFT-SIDE/FAR]
      rewards: {goal: 1.0, bump: -1.0, forbidden: -1.0}
    starts:
      border: 22

Other numbers of borders give other numbers of regions, 1 to 9 along each axis, which are then
called X1, X2, ... and Y1, Y2, ... Instead of borders and a width, `x_knots_m` and `y_knots_m` give
the knots of each axis (`RegionMap`); instead of `border: N`, a list of
`{x_m, y_m, heading_deg}` gives each start.

AprilTags are landmarks as well, instead of LEDs or in addition to them, upright on walls or posts:

    tag_family: 36h11       # the default; or 16h5, 25h9, 36h10
    tags:                   # the side of the black square; the centre; facing 90: towards +y
      - {id: 0, size_m: 0.2, x_m: 0.6, y_m: 0.0, z_m: 1.3, facing_deg: 90}

Two further entries are optional: `sonar: on`, and obstacles, cylinders or boxes, standing or on a
closed track (`Obstacle`), with which the sonar is on:

    obstacles:
      - {x_m: 1.0, y_m: 2.0, radius_m: 0.2, height_m: 0.9}
      - {x_m: 0.6, y_m: 3.0, length_m: 0.5, width_m: 0.3, heading_deg: 30,
         track_m: [[1.6, 3.0]], speed_m_per_s: 0.15}
"""

from collections.abc import Iterable, Mapping
import dataclasses
from dataclasses import MISSING, replace
import math
from pathlib import Path
from typing import Any, TypeVar, cast

import yaml

from goalreach_msgs_py.arena import Arena, check_size, paper_starts
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, GoalreachError, one_line
from goalreach_msgs_py.files import read_yaml
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.parameters import numbers_of
from goalreach_msgs_py.regions import RegionMap, Rewards, parse_region
from goalreach_msgs_py.tags import Tag
from goalreach_msgs_py.values import Pose2

ObjectT = TypeVar('ObjectT')
_FIELDS = ('name', 'width_m', 'length_m', 'regions', 'starts')
_OPTIONAL = ('leds_m', 'tags', 'tag_family', 'obstacles', 'sonar')
_KNOTS = ('x_knots_m', 'y_knots_m')
_BORDERS = ('x_borders_m', 'y_borders_m', 'transition_width_m')
_OF_REGIONS = ('actions', 'labels', 'forbidden', 'rewards')
_MAXIMUM_STARTS = 10_000


class _Loader(yaml.SafeLoader):
    """Loads plain values, and refuses duplicate keys."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:  # noqa: FBT001, FBT002 - as in PyYAML
        names: set[str] = set()
        for key, _ in node.value:
            if str(key.value) in names:
                place = f'at line {key.start_mark.line + 1}'
                raise GoalreachError(f'{one_line(key.value)} is given twice {place}')
            names.add(str(key.value))
        return super().construct_mapping(node, deep)


def read_arena(path: Path | str) -> Arena:
    """Read an arena and check it as a whole.

    Raises:
        FileFormatError: The file cannot be read, is not an arena, or its parts contradict each
            other; the line names the file, the field and the value.
    """
    try:
        return _arena(read_yaml(path, _Loader))
    except FileFormatError:
        raise
    except GoalreachError as error:
        line = str(error)
        if line.startswith('landmarks_m'):
            line = line.replace('landmarks_m', 'leds_m', 1)
        raise FileFormatError(path, line) from None


def _arena(document: object) -> Arena:
    fields = _mapping(document, 'the file', _FIELDS, _OPTIONAL)
    width_m, length_m = (_number(fields[name], name) for name in ('width_m', 'length_m'))
    check_size('width_m', width_m)
    check_size('length_m', length_m)
    if 'leds_m' not in fields and 'tags' not in fields:
        raise GoalreachError('leds_m is missing')
    leds = _list(fields, 'leds_m', 'a list of [x, y, z]')
    tags = _list(fields, 'tags', 'a list of tags')
    obstacles = _list(fields, 'obstacles', 'a list of obstacles')
    regions = _regions(fields['regions'], (width_m, length_m))
    name = fields['name']
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise ConfigurationError('name', name, 'a text of one line')
    if not isinstance(sonar := fields.get('sonar', False), bool):
        raise ConfigurationError('sonar', sonar, 'on or off')
    # Without starts at first: they are placed along borders that must have been checked before.
    arena = Arena(
        name=name,
        width_m=width_m,
        length_m=length_m,
        landmarks_m=tuple(numbers_of(led, (3,), f'leds_m[{k}]') for k, led in enumerate(leds)),
        regions=regions,
        starts=(),
        tags=tuple(_object(Tag, tag, f'tags[{k}]') for k, tag in enumerate(tags)),
        tag_family=str(fields.get('tag_family', '36h11')),
        obstacles=tuple(
            _object(Obstacle, one, f'obstacles[{k}]') for k, one in enumerate(obstacles)
        ),
        sonar=sonar,
    )
    return replace(arena, starts=_starts(fields['starts'], arena))


def _regions(value: object, sizes_m: tuple[float, float]) -> RegionMap:
    given = value if isinstance(value, dict) else {}
    names = _KNOTS if any(name in given for name in _KNOTS) else _BORDERS
    fields = _mapping(value, 'regions', (*names, 'goal'), _OF_REGIONS)
    named = _mapping(given['labels'], 'regions.labels', ('x', 'y')) if 'labels' in given else {}
    own = tuple(_texts(named[axis], f'labels.{axis}', least=1) for axis in sorted(named))
    forbidden = _texts(given.get('forbidden', []), 'forbidden')
    goal = fields['goal']
    if not isinstance(goal, str):
        raise ConfigurationError('regions.goal', goal, 'a region such as FRONT/NEAR')
    axes_m = [numbers_of(fields[name], (None,), f'regions.{name}') for name in names[:2]]
    if names is _BORDERS:
        width_m = _number(fields[_BORDERS[2]], f'regions.{_BORDERS[2]}')
        pairs = zip(axes_m, sizes_m, strict=True)
        axes_m = [knots_around(borders_m, width_m, size_m) for borders_m, size_m in pairs]
    x_knots_m, y_knots_m = axes_m
    try:
        shape = len(x_knots_m) // 2, len(y_knots_m) // 2
        return RegionMap(
            x_knots_m=x_knots_m,
            y_knots_m=y_knots_m,
            goal=parse_region(goal, shape, own, field='goal'),
            forbidden=tuple(
                parse_region(name, shape, own, field='forbidden') for name in forbidden
            ),
            actions=given.get('actions', 8),
            rewards=Rewards.read(given.get('rewards', {})),
            own_labels=own,
        )
    except ConfigurationError as error:
        raise ConfigurationError(f'regions.{error.field}', error.value, error.allowed) from None


def _texts(value: object, name: str, least: int = 0) -> tuple[str, ...]:
    texts = value if isinstance(value, list) else [None]
    if len(texts) < least or not all(isinstance(text, str) for text in texts):
        raise ConfigurationError(f'regions.{name}', value, 'a list of texts')
    return tuple(texts)


def knots_around(borders_m: Iterable[float], width_m: float, size_m: float) -> tuple[float, ...]:
    """Return the knots of an axis whose transition areas lie around its borders."""
    around = (border_m + side * width_m / 2 for border_m in borders_m for side in (-1, 1))
    return (0.0, *(round(float(knot_m), 9) for knot_m in around), size_m)


def _starts(value: object, arena: Arena) -> tuple[Pose2, ...]:
    if isinstance(value, dict):
        count = _mapping(value, 'starts', ('border',))['border']
        if type(count) is not int or not 1 <= count <= _MAXIMUM_STARTS:
            raise ConfigurationError(
                'starts.border', count, f'a whole number in [1, {_MAXIMUM_STARTS}]'
            )
        return paper_starts(arena.regions, count)
    if not isinstance(value, list) or not 1 <= len(value) <= _MAXIMUM_STARTS:
        allowed = 'a list of {x_m, y_m, heading_deg}, or {border: N}'
        raise ConfigurationError('starts', value, allowed)
    return tuple(_object(Pose2, pose, f'starts[{k}]') for k, pose in enumerate(value))


def _list(fields: Mapping[str, Any], name: str, allowed: str) -> list[Any]:
    value = fields.get(name, [])
    if not isinstance(value, list):
        raise ConfigurationError(name, value, allowed)
    return value


def _object(kind: type[ObjectT], value: object, place: str) -> ObjectT:
    """Return a dataclass from a mapping of its fields, angles in degrees.

    Raises:
        GoalreachError: The value, a key or a field is refused; the place is named.
    """
    fields = {f.name.replace('_rad', '_deg'): f for f in dataclasses.fields(cast('Any', kind))}
    names = tuple(name for name, field in fields.items() if field.default is MISSING)
    given = _mapping(value, place, names, tuple(name for name in fields if name not in names))
    values = {
        fields[name].name: _field(fields[name].type, content, f'{place}.{name}')
        for name, content in given.items()
    }
    try:
        return kind(**values)
    except ConfigurationError as error:
        raise ConfigurationError(f'{place}.{error.field}', error.value, error.allowed) from None


def _field(kind: object, value: object, place: str) -> object:
    """Return a whole number, a number, or a track."""
    if kind is int:
        if type(value) is not int:
            raise ConfigurationError(place, value, 'a whole number')
        return value
    if kind is float:
        number = _number(value, place)
        return math.radians(number) if place.endswith('_deg') else number
    if not isinstance(value, list):
        raise ConfigurationError(place, value, 'a list of [x, y]')
    return tuple(numbers_of(at, (2,), f'{place}[{k}]') for k, at in enumerate(value))


def _mapping(
    value: object, place: str, names: tuple[str, ...], optional: tuple[str, ...] = ()
) -> Mapping[str, Any]:
    """Return a mapping that has these keys, and perhaps the optional ones.

    Raises:
        GoalreachError: It is not a mapping, or a key is unknown or missing.
    """
    if not isinstance(value, dict):
        raise ConfigurationError(place, value, 'a mapping of ' + ', '.join(names))
    prefix = '' if place == 'the file' else f'{place}.'
    for key, content in value.items():
        if key not in (*names, *optional):
            known = ', '.join((*names, *optional))
            raise ConfigurationError(f'{prefix}{key}', content, f'left out: known are {known}')
    for name in names:
        if name not in value:
            raise GoalreachError(f'{prefix}{name} is missing')
    return value


def _number(value: object, place: str) -> float:
    return numbers_of(value, (), place)[0]
