"""The policy file: JSON, format `goalreach-policy`, version 1."""

from importlib import resources
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from goalreach_learning.policy import Policy
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, GoalreachError
from goalreach_msgs_py.files import read_json, write_text_atomically
from goalreach_msgs_py.parameters import is_number, numbers_of
from goalreach_msgs_py.regions import ACTION_COUNTS, GOAL_REGION, RegionMap, Rewards
from goalreach_msgs_py.values import FloatArray, Region

_FORMAT = 'goalreach-policy'
_VERSION = 1
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

    A name wins over a file of the same name in the working folder, which `./paper` names.
    """
    return _POLICIES / f'{policy}.json' if policy in policy_names() else Path(policy)


def read_policy(path: Path | str) -> Policy:
    """Read a policy, by name or from a file as `find_policy` finds it.

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
    if (given := _at(document, 'format', None)) != _FORMAT:
        raise ConfigurationError('format', given, repr(_FORMAT))
    version = _at(document, 'version', None)
    if version != _VERSION or isinstance(version, bool):
        raise ConfigurationError('version', version, str(_VERSION))
    given = _at(document, 'actions_rad')
    count = len(given) if isinstance(given, list) and len(given) in ACTION_COUNTS else 8
    actions = _array(document, 'actions_rad', (count,))
    if not np.allclose(actions, _actions_rad(count), rtol=0.0, atol=_ANGLE_TOLERANCE_RAD):
        raise ConfigurationError('actions_rad', given, f'k * pi / {count // 2}')
    regions = _regions(document, count)
    shape = (*regions.shape, count)
    visits = _array(document, 'visits', shape)
    bad = visits[(visits < 0) | (visits > _MOST_VISITS) | (visits != np.floor(visits))]
    if len(bad):
        raise ConfigurationError('visits', float(bad[0]), 'whole numbers in [0, 2^53]')
    return Policy(
        q=_array(document, 'q', shape),
        visits=visits.astype(np.int64),
        regions=regions,
        learning=_learning(_object(document, 'learning')),
        learner=_learner(document),
    )


def _actions_rad(count: int) -> list[float]:
    return [math.radians(360.0 / count * action) for action in range(count)]


def _learning(fields: dict[str, Any]) -> dict[str, Any]:
    for name, value in fields.items():
        if not isinstance(value, (str, bool)) and not is_number(value):
            raise ConfigurationError(f'learning.{name}', value, 'a finite number or a text')
    gamma = fields.get('gamma', 0.0)
    if not isinstance(gamma, (int, float)) or not 0.0 <= gamma < 1.0:
        raise ConfigurationError('learning.gamma', gamma, 'a number in [0, 1)')
    return fields


def _learner(document: object) -> dict[str, Any]:
    """Return name and state of the learner, whose content it checks itself; the paper's is {}."""
    if _at(document, 'learner', None) is None:
        return {}
    name = _at(document, 'learner.name', None)
    if not isinstance(name, str):
        raise ConfigurationError('learner.name', name, 'a text')
    return {'name': name, 'state': _object(document, 'learner.state')}


def _regions(document: object, actions: int) -> RegionMap:
    forbidden = _at(document, 'regions.forbidden', [])
    if not isinstance(forbidden, list):
        raise ConfigurationError('regions.forbidden', forbidden, 'a list of regions')
    x_knots_m, y_knots_m = (
        numbers_of(_at(document, place), (None,), place)
        for place in ('regions.x_knots_m', 'regions.y_knots_m')
    )
    try:
        return RegionMap(
            x_knots_m=x_knots_m,
            y_knots_m=y_knots_m,
            goal=_region(_at(document, 'regions.goal', [*GOAL_REGION]), 'goal'),
            actions=actions,
            forbidden=tuple(_region(one, 'forbidden') for one in forbidden),
            rewards=Rewards.read(_at(document, 'regions.rewards', {})),
        )
    except ConfigurationError as error:
        raise ConfigurationError(f'regions.{error.field}', error.value, error.allowed) from None


def _region(value: object, name: str) -> Region:
    if not isinstance(value, list) or [type(index) for index in value] != [int, int]:
        raise ConfigurationError(name, value, 'two indices')
    return value[0], value[1]


def _at(document: object, place: str, default: object = ...) -> Any:  # noqa: ANN401 - JSON
    """Return the part of a document at a dotted place; without a default it must be there."""
    above, _, name = place.rpartition('.')
    fields = _object(document, above) if above else document
    if not isinstance(fields, dict):
        raise ConfigurationError('the file', fields, 'an object')
    if name not in fields and default is ...:
        raise GoalreachError(f'{place} is missing')
    return fields.get(name, default)


def _object(document: object, place: str) -> dict[str, Any]:
    if not isinstance(value := _at(document, place), dict):
        raise ConfigurationError(place, value, 'an object')
    return value


def _array(document: object, name: str, shape: tuple[int, ...]) -> FloatArray:
    return np.array(numbers_of(_at(document, name), shape, name), dtype=np.float64).reshape(shape)


def write_policy(path: Path | str, policy: Policy) -> None:
    """Write a policy file, or replace it, atomically: even after a crash it is complete.

    Raises:
        FileFormatError: The file cannot be written, or cannot hold what the learner saves.
    """
    regions = policy.regions
    document = {
        'format': _FORMAT,
        'version': _VERSION,
        'q': policy.q.tolist(),
        'visits': policy.visits.tolist(),
        'actions_rad': _actions_rad(regions.actions),
        'regions': {
            'x_knots_m': list(regions.x_knots_m),
            'y_knots_m': list(regions.y_knots_m),
            'goal': list(regions.goal),
            **({'forbidden': [list(r) for r in regions.forbidden]} if regions.forbidden else {}),
            **({'rewards': vars(regions.rewards)} if regions.rewards != Rewards() else {}),
        },
        'learning': dict(policy.learning),
        **({'learner': dict(policy.learner)} if policy.learner else {}),
    }
    try:
        text = json.dumps(document, indent=1, allow_nan=False) + '\n'
    except (TypeError, ValueError) as error:
        raise FileFormatError(path, f'what the learner saves: {error}') from None
    write_text_atomically(path, text)
