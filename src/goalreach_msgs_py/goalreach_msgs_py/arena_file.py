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
    starts:
      border: 22

Instead of borders and a width, `x_knots_m` and `y_knots_m` give the six knots of each axis
(`RegionMap`); instead of `border: N`, a list of `{x_m, y_m, heading_deg}` gives each start.
"""

from collections.abc import Mapping
from dataclasses import replace
import math
from pathlib import Path
from typing import Any

import yaml

from goalreach_msgs_py.arena import Arena, check_size, paper_starts
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, GoalreachError, one_line
from goalreach_msgs_py.files import read_yaml
from goalreach_msgs_py.parameters import numbers_of
from goalreach_msgs_py.regions import RegionMap, parse_region
from goalreach_msgs_py.values import Pose2

_FIELDS = ('name', 'width_m', 'length_m', 'leds_m', 'regions', 'starts')
_KNOTS = ('x_knots_m', 'y_knots_m')
_BORDERS = ('x_borders_m', 'y_borders_m', 'transition_width_m')
_START = ('x_m', 'y_m', 'heading_deg')
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

    Args:
        path: The file.

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
    fields = _mapping(document, 'the file', _FIELDS)
    width_m, length_m = (_number(fields[name], name) for name in ('width_m', 'length_m'))
    check_size('width_m', width_m)
    check_size('length_m', length_m)
    leds = fields['leds_m']
    if not isinstance(leds, list):
        raise ConfigurationError('leds_m', leds, 'a list of [x, y, z]')
    regions = _regions(fields['regions'], (width_m, length_m))
    # Without starts at first: they are placed along borders that must have been checked before.
    arena = Arena(
        name=_name(fields['name']),
        width_m=width_m,
        length_m=length_m,
        landmarks_m=tuple(numbers_of(led, (3,), f'leds_m[{k}]') for k, led in enumerate(leds)),
        regions=regions,
        starts=(),
    )
    return replace(arena, starts=_starts(fields['starts'], arena))


def _name(value: object) -> str:
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise ConfigurationError('name', value, 'a text of one line')
    return value


def _regions(value: object, sizes_m: tuple[float, float]) -> RegionMap:
    given = value if isinstance(value, dict) else {}
    names = _KNOTS if any(name in given for name in _KNOTS) else _BORDERS
    fields = _mapping(value, 'regions', (*names, 'goal'))
    goal = fields['goal']
    if not isinstance(goal, str):
        raise ConfigurationError('regions.goal', goal, 'a region such as FRONT/NEAR')
    if names is _KNOTS:
        x_knots_m, y_knots_m = (numbers_of(fields[n], (6,), f'regions.{n}') for n in _KNOTS)
    else:
        width_m = _number(fields[_BORDERS[2]], f'regions.{_BORDERS[2]}')
        x_knots_m, y_knots_m = (
            _knots(numbers_of(fields[name], (2,), f'regions.{name}'), width_m, size_m)
            for name, size_m in zip(_BORDERS, sizes_m, strict=False)
        )
    try:
        return RegionMap(x_knots_m=x_knots_m, y_knots_m=y_knots_m, goal=parse_region(goal))
    except ConfigurationError as error:
        field = 'goal' if error.field == 'region' else error.field
        raise ConfigurationError(f'regions.{field}', error.value, error.allowed) from None


def _knots(borders_m: tuple[float, ...], width_m: float, size_m: float) -> tuple[float, ...]:
    """Return the six knots of an axis whose transition areas lie around two borders."""
    around = (border_m + side * width_m / 2 for border_m in borders_m for side in (-1, 1))
    return (0.0, *(round(knot_m, 9) for knot_m in around), size_m)


def _starts(value: object, arena: Arena) -> tuple[Pose2, ...]:
    if isinstance(value, dict):
        count = _mapping(value, 'starts', ('border',))['border']
        if type(count) is not int or not 1 <= count <= _MAXIMUM_STARTS:
            raise ConfigurationError(
                'starts.border', count, f'a whole number in [1, {_MAXIMUM_STARTS}]'
            )
        return paper_starts(
            width_m=arena.width_m, length_m=arena.length_m, regions=arena.regions, count=count
        )
    if not isinstance(value, list) or not 1 <= len(value) <= _MAXIMUM_STARTS:
        allowed = 'a list of {x_m, y_m, heading_deg}, or {border: N}'
        raise ConfigurationError('starts', value, allowed)
    return tuple(_start(pose, f'starts[{index}]') for index, pose in enumerate(value))


def _start(value: object, place: str) -> Pose2:
    fields = _mapping(value, place, _START)
    x_m, y_m, heading_deg = (_number(fields[name], f'{place}.{name}') for name in _START)
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=math.radians(heading_deg))


def _mapping(value: object, place: str, names: tuple[str, ...]) -> Mapping[str, Any]:
    """Return a mapping that has exactly these keys.

    Raises:
        GoalreachError: It is not a mapping, or a key is unknown or missing.
    """
    if not isinstance(value, dict):
        raise ConfigurationError(place, value, 'a mapping of ' + ', '.join(names))
    prefix = '' if place == 'the file' else f'{place}.'
    for key, content in value.items():
        if key not in names:
            raise ConfigurationError(
                f'{prefix}{key}', content, 'left out: known are ' + ', '.join(names)
            )
    for name in names:
        if name not in value:
            raise GoalreachError(f'{prefix}{name} is missing')
    return value


def _number(value: object, place: str) -> float:
    return numbers_of(value, (), place)[0]
