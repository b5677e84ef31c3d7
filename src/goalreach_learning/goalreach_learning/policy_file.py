"""The policy file: JSON, format `goalreach-policy`, version 1."""

from collections.abc import Mapping
from importlib import resources
import json
from pathlib import Path
from typing import Any

import numpy as np

from goalreach_learning.policy import Policy
from goalreach_learning.task import ACTIONS_RAD
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, GoalreachError
from goalreach_msgs_py.files import read_json, write_text_atomically
from goalreach_msgs_py.parameters import is_number, numbers_of
from goalreach_msgs_py.regions import GOAL_REGION, RegionMap

_FORMAT = 'goalreach-policy'
_VERSION = 1
_SHAPE = (3, 3, 8)
_ANGLE_TOLERANCE_RAD = 1e-6
_MOST_VISITS = 2**53
_POLICIES = Path(str(resources.files('goalreach_learning'))) / 'config' / 'policies'


def policy_names() -> list[str]:
    """Return the names of the policies that come with the project.

    `paper` is what `goalreach train --seed 7` writes.
    """
    return sorted(path.stem for path in _POLICIES.glob('*.json'))


def find_policy(policy: Path | str) -> Path:
    """Return the file of a policy given by name or by file.

    Args:
        policy: One of `policy_names`, or a file. A name wins over a file of the same name in the
            working folder, which `./paper` names.
    """
    return _POLICIES / f'{policy}.json' if policy in policy_names() else Path(policy)


def read_policy(path: Path | str) -> Policy:
    """Read a policy, from a file or by the name of one that comes with the project.

    Args:
        path: The name or the file, as for `find_policy`.

    Raises:
        FileFormatError: The file cannot be read or is not a policy; the message names file, field
            and value.
    """
    document = read_json(path := find_policy(path))
    try:
        return _policy(document)
    except GoalreachError as error:
        raise FileFormatError(path, str(error)) from None


def _policy(document: object) -> Policy:
    fields = _mapping(document, 'the file')
    if fields.get('format') != _FORMAT:
        raise ConfigurationError('format', fields.get('format'), repr(_FORMAT))
    version = fields.get('version')
    if version != _VERSION or isinstance(version, bool):
        raise ConfigurationError('version', version, str(_VERSION))
    actions = _array(fields, 'actions_rad', _SHAPE[2:])
    if not np.allclose(actions, ACTIONS_RAD, rtol=0.0, atol=_ANGLE_TOLERANCE_RAD):
        raise ConfigurationError('actions_rad', fields['actions_rad'], 'k * pi / 4')
    visits = _array(fields, 'visits', _SHAPE)
    bad = visits[(visits < 0) | (visits > _MOST_VISITS) | (visits != np.floor(visits))]
    if len(bad):
        raise ConfigurationError('visits', float(bad[0]), 'whole numbers in [0, 2^53]')
    return Policy(
        q=_array(fields, 'q', _SHAPE),
        visits=visits.astype(np.int64),
        regions=_regions(_mapping(_get(fields, 'regions'), 'regions')),
        learning=_learning(_mapping(_get(fields, 'learning'), 'learning')),
    )


def _learning(fields: Mapping[str, Any]) -> dict[str, Any]:
    for name, value in fields.items():
        if not isinstance(value, (str, bool)) and not is_number(value):
            raise ConfigurationError(f'learning.{name}', value, 'a finite number or a text')
    gamma = fields.get('gamma', 0.0)
    if not isinstance(gamma, (int, float)) or not 0.0 <= gamma < 1.0:
        raise ConfigurationError('learning.gamma', gamma, 'a number in [0, 1)')
    return dict(fields)


def _regions(fields: Mapping[str, Any]) -> RegionMap:
    knots = {}
    for name in ('x_knots_m', 'y_knots_m'):
        values = _array(fields, name, (6,), prefix='regions.')
        knots[name] = tuple(float(v) for v in values)
    goal = fields.get('goal', list(GOAL_REGION))
    whole = isinstance(goal, list) and all(type(index) is int for index in goal)
    if not whole or len(goal) != 2 or not all(0 <= g <= 2 for g in goal):  # noqa: PLR2004
        raise ConfigurationError('regions.goal', goal, 'two indices in 0..2')
    try:
        return RegionMap(**knots, goal=(goal[0], goal[1]))
    except ConfigurationError as error:
        raise ConfigurationError(f'regions.{error.field}', error.value, error.allowed) from None


def _get(fields: Mapping[str, Any], name: str, prefix: str = '') -> object:
    if name not in fields:
        raise GoalreachError(f'{prefix}{name} is missing')
    return fields[name]


def _mapping(value: object, name: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise ConfigurationError(name, value, 'an object')
    return value


def _array(
    fields: Mapping[str, Any], name: str, shape: tuple[int, ...], *, prefix: str = ''
) -> Any:  # noqa: ANN401 - a float array
    numbers = numbers_of(_get(fields, name, prefix), shape, prefix + name)
    return np.array(numbers, dtype=np.float64).reshape(shape)


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
