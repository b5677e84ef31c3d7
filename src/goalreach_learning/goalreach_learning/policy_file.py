"""The policy file: JSON, format `goalreach-policy`, version 1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from goalreach_learning.policy import Policy
from goalreach_learning.task import ACTIONS_RAD
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError
from goalreach_msgs_py.files import write_text_atomically
from goalreach_msgs_py.regions import GOAL_REGION, RegionMap

_FORMAT = 'goalreach-policy'
_VERSION = 1
_SHAPE = (3, 3, 8)
_ANGLE_TOLERANCE_RAD = 1e-6
_MOST_VISITS = 2**53


class _DefectError(Exception):
    """A defect of the file, described without the file's name."""


def read_policy(path: Path | str) -> Policy:
    """Read a policy file.

    Args:
        path: The file.

    Raises:
        FileFormatError: The file cannot be read or is not a policy; the message names file, field
            and value.
    """
    try:
        document = json.loads(Path(path).read_text(encoding='utf-8'))
    except OSError as error:
        raise FileFormatError(path, f'cannot be read: {error.strerror}') from None
    except (ValueError, RecursionError) as error:
        raise FileFormatError(path, f'is not JSON: {error}') from None
    try:
        return _policy(document)
    except _DefectError as error:
        raise FileFormatError(path, str(error)) from None
    except ConfigurationError as error:
        raise FileFormatError(path, f'regions.{error}') from None


def _policy(document: object) -> Policy:
    fields = _mapping(document, 'the file')
    if fields.get('format') != _FORMAT:
        raise _DefectError(f'format = {_short(fields.get("format"))}: must be {_FORMAT!r}')
    version = fields.get('version')
    if version != _VERSION or isinstance(version, bool):
        raise _DefectError(f'version = {_short(version)}: must be {_VERSION}')
    actions = _array(fields, 'actions_rad', _SHAPE[2:])
    if not np.allclose(actions, ACTIONS_RAD, rtol=0.0, atol=_ANGLE_TOLERANCE_RAD):
        raise _DefectError(f'actions_rad = {_short(fields["actions_rad"])}: must be k * pi / 4')
    visits = _array(fields, 'visits', _SHAPE)
    bad = visits[(visits < 0) | (visits > _MOST_VISITS) | (visits != np.floor(visits))]
    if len(bad):
        raise _DefectError(f'visits holds {bad[0]:g}: must be whole numbers in [0, 2^53]')
    return Policy(
        q=_array(fields, 'q', _SHAPE),
        visits=visits.astype(np.int64),
        regions=_regions(_mapping(_get(fields, 'regions'), 'regions')),
        learning=_learning(_mapping(_get(fields, 'learning'), 'learning')),
    )


def _learning(fields: Mapping[str, Any]) -> dict[str, Any]:
    for name, value in fields.items():
        if isinstance(value, float) and not math.isfinite(value):
            raise _DefectError(f'learning.{name} = {value!r}: must be finite')
        if not isinstance(value, (str, int, float)):
            raise _DefectError(f'learning.{name} = {_short(value)}: must be a number or a text')
    gamma = fields.get('gamma', 0.0)
    if not isinstance(gamma, (int, float)) or not 0.0 <= gamma < 1.0:
        raise _DefectError(f'learning.gamma = {gamma!r}: must be a number in [0, 1)')
    return dict(fields)


def _regions(fields: Mapping[str, Any]) -> RegionMap:
    knots = {}
    for name in ('x_knots_m', 'y_knots_m'):
        values = _array(fields, name, (6,), prefix='regions.')
        knots[name] = tuple(float(v) for v in values)
    goal = fields.get('goal', list(GOAL_REGION))
    whole = isinstance(goal, list) and all(type(index) is int for index in goal)
    if not whole or len(goal) != 2 or not all(0 <= g <= 2 for g in goal):  # noqa: PLR2004
        raise _DefectError(f'regions.goal = {_short(goal)}: must be two indices in 0..2')
    return RegionMap(**knots, goal=(goal[0], goal[1]))


def _get(fields: Mapping[str, Any], name: str, prefix: str = '') -> object:
    if name not in fields:
        raise _DefectError(f'{prefix}{name} is missing')
    return fields[name]


def _mapping(value: object, name: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise _DefectError(f'{name} = {_short(value)}: must be an object')
    return value


def _array(
    fields: Mapping[str, Any], name: str, shape: tuple[int, ...], *, prefix: str = ''
) -> Any:  # noqa: ANN401 - a float array
    value = _get(fields, name, prefix)
    numbers = _numbers(value, shape, prefix + name)
    return np.array(numbers, dtype=np.float64).reshape(shape)


def _numbers(value: object, shape: Sequence[int], place: str) -> list[float]:
    """Return the numbers of nested lists of a shape in order, or refuse the first defect."""
    if not shape:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise _DefectError(f'{place} = {_short(value)}: must be a number')
        if abs(value) > 1e300 or not math.isfinite(value):  # noqa: PLR2004 - fits a float64
            raise _DefectError(f'{place} = {_short(value)}: must be finite')
        return [float(value)]
    if not isinstance(value, list) or len(value) != shape[0]:
        found = f'{len(value)} elements' if isinstance(value, list) else _short(value)
        raise _DefectError(f'{place} has {found}: must be a list of {shape[0]}')
    return [
        number
        for index, element in enumerate(value)
        for number in _numbers(element, shape[1:], f'{place}[{index}]')
    ]


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + '...'  # noqa: PLR2004 - one clear line


def write_policy(path: Path | str, policy: Policy) -> None:
    """Write a policy file atomically: even after a crash it is complete.

    Args:
        path: The file, which is replaced if it exists.
        policy: The policy.

    Raises:
        FileFormatError: The file cannot be written.
    """
    regions = policy.regions
    document = {
        'format': _FORMAT,
        'version': _VERSION,
        'q': policy.q.tolist(),
        'visits': policy.visits.tolist(),
        'actions_rad': list(ACTIONS_RAD),
        'regions': {
            'x_knots_m': list(regions.x_knots_m),
            'y_knots_m': list(regions.y_knots_m),
            'goal': list(regions.goal),
        },
        'learning': dict(policy.learning),
    }
    text = json.dumps(document, indent=1, allow_nan=False) + '\n'
    write_text_atomically(path, text)
