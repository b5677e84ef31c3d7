"""Messages of type DiagnosticArray (status, region state, finished action); Q-table and learner.

diagnostic_msgs carry names and texts, so that a stock `ros2 topic echo` shows states and actions
in the paper's words. A number is written as the shortest decimal that gives the same float. See
`pose_messages` for the conventions.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
import json
import math
from typing import Any, Final

import numpy as np

from goalreach_msgs_py.cdr import CdrReader, CdrWriter, MessageError
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.pose_messages import require_finite
from goalreach_msgs_py.regions import labels, parse_region, region_name
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, MAP_FRAME
from goalreach_msgs_py.values import (
    Confidence,
    FloatArray,
    PathOutcome,
    Pose2,
    RegionState,
    Transition,
)

OK: Final = 0
WARN: Final = 1
STALE: Final = 3
"""Levels of a diagnostic_msgs/DiagnosticStatus."""

_LEVELS = {Confidence.OK: OK, Confidence.UNCERTAIN: WARN, Confidence.STALE: STALE}
_CONFIDENCES = {level: confidence for confidence, level in _LEVELS.items()}
_STATE_NAME = 'region_state'
_TRANSITION_NAME = 'transition'
_Q_LABELS = ('x', 'y', 'action')


@dataclass(frozen=True, kw_only=True)
class Status:
    """A diagnostic_msgs/DiagnosticStatus.

    Attributes:
        level: `OK`, `WARN`, 2 for an error, or `STALE`.
        name: What it is the status of.
        message: One line for people.
        hardware_id: Who reports it.
        values: Texts by key.
    """

    level: int = OK
    name: str
    message: str
    hardware_id: str
    values: Mapping[str, str]


@lru_cache
def _state_keys(columns: int, rows: int) -> tuple[str, ...]:
    """Return the keys of a state's values in their order."""
    axes = zip('xy', labels((columns, rows)), strict=True)
    mu = (f'mu_{axis}.{label}' for axis, names in axes for label in names)
    return (*mu, 'x_m', 'y_m', 'heading_rad', 'goal_probability')


def statuses_to_raw(statuses: Sequence[Status], stamp_ns: int, frame_id: str = '') -> bytes:
    """Return statuses as diagnostic_msgs/DiagnosticArray."""
    writer = CdrWriter(stamp_ns, frame_id)
    writer.numbers('I', len(statuses))
    for status in statuses:
        writer.numbers('B', status.level)
        writer.text(status.name, status.message, status.hardware_id)
        writer.numbers('I', len(status.values))
        for pair in status.values.items():
            writer.text(*pair)
    return writer.raw()


def statuses_from_raw(raw: bytes) -> list[Status]:
    """Return the statuses of a diagnostic_msgs/DiagnosticArray.

    Raises:
        MessageError: It cannot be read.
    """
    reader = CdrReader(raw)
    statuses = []
    for _ in range(reader.count(least=20)):
        (level,) = reader.numbers('B')
        name, message, hardware_id = reader.texts(3)
        texts = reader.texts(2 * reader.count(least=10))
        values = dict(zip(texts[::2], texts[1::2], strict=True))
        statuses.append(
            Status(level=level, name=name, message=message, hardware_id=hardware_id, values=values)
        )
    return statuses


def _status(raw: bytes, name: str) -> Status:
    for status in statuses_from_raw(raw):
        if status.name == name:
            return status
    raise MessageError(f'status without the name {name}')


def state_to_raw(state: RegionState, stamp_ns: int, prefix: str = '') -> bytes:
    """Return a region state as diagnostic_msgs/DiagnosticArray with one status."""
    pose = state.pose
    place = (pose.x_m, pose.y_m, pose.heading_rad)
    numbers = (*state.mu_x, *state.mu_y, *place, state.goal_probability)
    shape = len(state.mu_x), len(state.mu_y)
    status = Status(
        level=_LEVELS[state.confidence],
        name=_STATE_NAME,
        message=region_name(state.region, shape),
        hardware_id=ESTIMATOR,
        values=dict(zip(_state_keys(*shape), (repr(float(n)) for n in numbers), strict=True)),
    )
    return statuses_to_raw([status], stamp_ns, prefix + MAP_FRAME)


def state_from_raw(raw: bytes) -> RegionState:
    """Return the region state of a diagnostic_msgs/DiagnosticArray.

    Raises:
        MessageError: The status `region_state` or a value is missing, or no finite number.
    """
    status = _status(raw, _STATE_NAME)
    if status.level not in _CONFIDENCES:
        raise MessageError(f'level = {status.level}: must be OK, WARN or STALE')
    columns, rows = (sum(key.startswith(mu) for key in status.values) for mu in ('mu_x', 'mu_y'))
    numbers = [_number(status.values, key) for key in _state_keys(columns, rows)]
    x_m, y_m, heading_rad, goal_probability = numbers[columns + rows :]
    try:
        region = parse_region(status.message, (columns, rows))
    except ConfigurationError as error:
        raise MessageError(str(error)) from None
    return RegionState(
        region=region,
        mu_x=tuple(numbers[:columns]),
        mu_y=tuple(numbers[columns : columns + rows]),
        pose=Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad),
        goal_probability=goal_probability,
        confidence=_CONFIDENCES[status.level],
    )


def _number(values: Mapping[str, str], key: str) -> float:
    try:
        return require_finite(key, float(values[key]))
    except KeyError:
        raise MessageError(f'values without {key}') from None
    except ValueError:
        raise MessageError(f'{key} = {values[key]!r}: must be a number') from None


def transition_to_raw(
    transition: Transition, stamp_ns: int, shape: tuple[int, int] = (3, 3)
) -> bytes:
    """Return a finished action as diagnostic_msgs/DiagnosticArray with one status.

    The names of regions depend on the numbers of columns and rows, `shape`.
    """
    state = region_name(transition.state, shape)
    next_state = region_name(transition.next_state, shape)
    status = Status(
        name=_TRANSITION_NAME,
        message=f'{state} -> {next_state}',
        hardware_id=CONTROLLER,
        values={
            'state': state,
            'action': str(transition.action),
            'reward': repr(transition.reward),
            'next_state': next_state,
            'temperature': repr(transition.temperature),
            'trial': str(transition.trial),
            'path': str(transition.path),
            'outcome': '' if transition.outcome is None else transition.outcome.value,
        },
    )
    return statuses_to_raw([status], stamp_ns)


def transition_from_raw(raw: bytes) -> Transition:
    """Return the finished action of a diagnostic_msgs/DiagnosticArray.

    Raises:
        MessageError: A value is missing or cannot be read.
    """
    values = _status(raw, _TRANSITION_NAME).values
    try:
        return Transition(
            state=parse_region(values['state']),
            action=int(values['action']),
            reward=_number(values, 'reward'),
            next_state=parse_region(values['next_state']),
            temperature=_number(values, 'temperature'),
            trial=int(values['trial']),
            path=int(values['path']),
            outcome=PathOutcome(values['outcome']) if values['outcome'] else None,
        )
    except KeyError as error:
        raise MessageError(f'values without {error.args[0]}') from None
    except (ValueError, ConfigurationError) as error:
        raise MessageError(f'values: {error}') from None


def q_table_to_raw(q: FloatArray) -> bytes:
    """Return Q-values (3, 3, 8) as std_msgs/Float64MultiArray with dimensions x, y, action."""
    writer = CdrWriter()
    writer.numbers('I', q.ndim)
    for axis, (label, size) in enumerate(zip(_Q_LABELS, q.shape, strict=True)):
        writer.text(label)
        writer.numbers('2I', size, math.prod(q.shape[axis:]))
    writer.zeros('I')
    writer.numbers('I', q.size)
    writer.numbers(f'{q.size}d', *q.ravel().tolist())
    return writer.raw()


def learner_to_raw(learner: Mapping[str, Any]) -> bytes:
    """Return name and state of a learner as std_msgs/String, in JSON."""
    writer = CdrWriter()
    writer.text(json.dumps(learner, default=repr))
    return writer.raw()


def learner_from_raw(raw: bytes) -> Mapping[str, Any]:
    """Return name and state of a learner of a std_msgs/String.

    Raises:
        MessageError: It is no JSON object with both, or holds a number that is not finite.
    """
    try:
        learner = json.loads(CdrReader(raw, has_header=False).text())
        json.dumps(learner, allow_nan=False)
        return {'name': str(learner['name']), 'state': dict(learner['state'])}
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise MessageError(f'no learner: {error!r}') from None


def q_table_from_raw(raw: bytes) -> FloatArray:
    """Return the Q-values of a std_msgs/Float64MultiArray.

    Raises:
        MessageError: The dimensions are not x, y, action or do not fit the data, or a value is
            not finite.
    """
    reader = CdrReader(raw, has_header=False)
    dimensions = [(reader.text(), *reader.numbers('2I')) for _ in range(reader.count(least=13))]
    reader.skip('I')
    q = np.array(reader.sequence('d'), dtype=np.float64)
    labels = tuple(label for label, _, _ in dimensions)
    shape = tuple(size for _, size, _ in dimensions)
    if labels != _Q_LABELS or math.prod(shape) != q.size:
        raise MessageError(f'layout {labels} {shape}: must be {_Q_LABELS} and fit the data')
    if not np.isfinite(q).all():
        raise MessageError('data holds a number that is not finite')
    return q.reshape(shape)
