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

from __future__ import annotations

from collections.abc import Mapping
import math
from pathlib import Path
from typing import Any

import yaml

from goalreach_msgs_py.arena import Arena, check_size, paper_starts
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError
from goalreach_msgs_py.files import load_yaml
from goalreach_msgs_py.regions import RegionMap, parse_region
from goalreach_msgs_py.values import Pose2

_FIELDS = ('name', 'width_m', 'length_m', 'leds_m', 'regions', 'starts')
_KNOTS = ('x_knots_m', 'y_knots_m')
_BORDERS = ('x_borders_m', 'y_borders_m', 'transition_width_m')
_START = ('x_m', 'y_m', 'heading_deg')
_MOST_STARTS = 10_000
_LONGEST_TEXT = 60


class _DefectError(Exception):
    """A defect of the file, as a line without the file's name."""


def _defect(field: object, value: object, allowed: str) -> _DefectError:
    return _DefectError(f'{_short(field)} = {_short(repr(value))}: must be {allowed}')


def _short(what: object) -> str:
    text = ''.join(c if c.isprintable() else '?' for c in str(what))
    return text if len(text) <= _LONGEST_TEXT else text[: _LONGEST_TEXT - 3] + '...'


class _Loader(yaml.SafeLoader):
    """Loads plain values, and refuses a key that is there twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:  # noqa: FBT001, FBT002 - as in PyYAML
        names: set[str] = set()
        for key, _ in node.value:
            if str(key.value) in names:
                place = f'at line {key.start_mark.line + 1}'
                raise _DefectError(f'{_short(key.value)} is given twice {place}')
            names.add(str(key.value))
        return super().construct_mapping(node, deep)


def read_arena(path: Path | str) -> Arena:
    """Return the arena of a file, checked as a whole.

    Args:
        path: The file.

    Raises:
        FileFormatError: The file cannot be read, is not an arena, or its parts do not fit
            together; the line names the file, the field and the value.
    """
    try:
        text = Path(path).read_text(encoding='utf-8')
        document = load_yaml(text, _Loader)
    except OSError as error:
        raise FileFormatError(path, f'cannot be read: {error.strerror}') from None
    except UnicodeDecodeError:
        raise FileFormatError(path, 'is not UTF-8 text') from None
    except _DefectError as error:
        raise FileFormatError(path, str(error)) from None
    except yaml.YAMLError as error:
        where = getattr(error, 'problem_mark', None)
        place = '' if where is None else f' at line {where.line + 1}'
        raise FileFormatError(path, f'is not YAML{place}') from None
    try:
        return _arena(document)
    except _DefectError as error:
        raise FileFormatError(path, str(error)) from None
    except ConfigurationError as error:
        field = 'leds_m' + error.field[11:] if error.field[:11] == 'landmarks_m' else error.field
        defect = _defect(field, error.value, error.allowed)
        raise FileFormatError(path, str(defect)) from None


def _arena(document: object) -> Arena:
    fields = _mapping(document, 'the file', _FIELDS)
    width_m, length_m = (_size(fields[name], name) for name in ('width_m', 'length_m'))
    regions = _regions(fields['regions'], (width_m, length_m))
    # Without starts at first, so that the border along which they stand is known to be sound.
    arena = Arena(
        name=_name(fields['name']),
        width_m=width_m,
        length_m=length_m,
        landmarks_m=_leds(fields['leds_m']),
        regions=regions,
        starts=(),
    )
    return Arena(
        name=arena.name,
        width_m=width_m,
        length_m=length_m,
        landmarks_m=arena.landmarks_m,
        regions=regions,
        starts=_starts(fields['starts'], arena),
    )


def _name(value: object) -> str:
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise _defect('name', value, 'a text of one line')
    return value


def _size(value: object, name: str) -> float:
    size_m = _number(value, name)
    check_size(name, size_m)
    return size_m


def _leds(value: object) -> tuple[tuple[float, ...], ...]:
    if not isinstance(value, list):
        raise _defect('leds_m', value, 'a list of [x, y, z]')
    return tuple(_numbers(led, f'leds_m[{index}]', 3) for index, led in enumerate(value))


def _regions(value: object, sizes_m: tuple[float, float]) -> RegionMap:
    given = value if isinstance(value, dict) else {}
    names = _KNOTS if any(name in given for name in _KNOTS) else _BORDERS
    fields = _mapping(value, 'regions', (*names, 'goal'))
    goal = fields['goal']
    if not isinstance(goal, str):
        raise _defect('regions.goal', goal, 'a region such as FRONT/NEAR')
    if names is _KNOTS:
        x_knots_m, y_knots_m = (_numbers(fields[n], f'regions.{n}', 6) for n in _KNOTS)
    else:
        width_m = _number(fields[_BORDERS[2]], f'regions.{_BORDERS[2]}')
        x_knots_m, y_knots_m = (
            _knots(_numbers(fields[name], f'regions.{name}', 2), width_m, size_m)
            for name, size_m in zip(_BORDERS, sizes_m, strict=False)
        )
    try:
        return RegionMap(x_knots_m=x_knots_m, y_knots_m=y_knots_m, goal=parse_region(goal))
    except ConfigurationError as error:
        field = 'goal' if error.field == 'region' else error.field
        raise _defect(f'regions.{field}', error.value, error.allowed) from None


def _knots(borders_m: tuple[float, ...], width_m: float, size_m: float) -> tuple[float, ...]:
    """Return the six knots of an axis whose transition areas lie around two borders."""
    around = (border_m + side * width_m / 2 for border_m in borders_m for side in (-1, 1))
    return (0.0, *(round(knot_m, 9) for knot_m in around), size_m)


def _starts(value: object, arena: Arena) -> tuple[Pose2, ...]:
    if isinstance(value, dict):
        count = _mapping(value, 'starts', ('border',))['border']
        if type(count) is not int or not 1 <= count <= _MOST_STARTS:
            raise _defect('starts.border', count, f'a whole number in [1, {_MOST_STARTS}]')
        return paper_starts(
            width_m=arena.width_m, length_m=arena.length_m, regions=arena.regions, count=count
        )
    if not isinstance(value, list) or not 1 <= len(value) <= _MOST_STARTS:
        allowed = 'a list of {x_m, y_m, heading_deg}, or {border: N}'
        raise _defect('starts', value, allowed)
    return tuple(_start(pose, f'starts[{index}]') for index, pose in enumerate(value))


def _start(value: object, place: str) -> Pose2:
    fields = _mapping(value, place, _START)
    x_m, y_m, heading_deg = (_number(fields[name], f'{place}.{name}') for name in _START)
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=math.radians(heading_deg))


def _mapping(value: object, place: str, names: tuple[str, ...]) -> Mapping[str, Any]:
    """Return a mapping that has exactly these keys, or refuse the first that does not fit."""
    if not isinstance(value, dict):
        raise _defect(place, value, 'a mapping of ' + ', '.join(names))
    prefix = '' if place == 'the file' else f'{place}.'
    for key, content in value.items():
        if key not in names:
            raise _defect(f'{prefix}{key}', content, 'left out: known are ' + ', '.join(names))
    for name in names:
        if name not in value:
            raise _DefectError(f'{prefix}{name} is missing')
    return value


def _numbers(value: object, place: str, length: int) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != length:
        raise _defect(place, value, f'a list of {length} numbers')
    return tuple(_number(number, f'{place}[{index}]') for index, number in enumerate(value))


def _number(value: object, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise _defect(place, value, 'a number')
    if not abs(value) < 1e9:  # noqa: PLR2004 - refuses NaN, infinity and what no float holds
        raise _defect(place, value, 'a finite number')
    return float(value)
