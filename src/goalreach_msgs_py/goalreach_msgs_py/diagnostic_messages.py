"""What travels as diagnostics: any status, the region state, a finished action; and the Q-table.

diagnostic_msgs carry names and texts, so that a stock `ros2 topic echo` shows states and actions
in the paper's words. A number is written as the shortest decimal that gives the same float. See
`pose_messages` for the conventions.
"""

from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import Final

import numpy as np

from goalreach_msgs_py.cdr import CdrReader, CdrWriter, MessageError
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.pose_messages import require_finite
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS, parse_region, region_name
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
_MEMBERSHIPS = (*(f'mu_x.{x}' for x in X_LABELS), *(f'mu_y.{y}' for y in Y_LABELS))
_STATE_KEYS = (*_MEMBERSHIPS, 'x_m', 'y_m', 'heading_rad', 'goal_probability')
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


def status_to_raw(status: Status, stamp_ns: int, frame_id: str = '') -> bytes:
    """Return a status as diagnostic_msgs/DiagnosticArray."""
    writer = CdrWriter(stamp_ns, frame_id)
    writer.numbers('I', 1)
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


def state_to_raw(state: RegionState, stamp_ns: int) -> bytes:
    """Return a region state as diagnostic_msgs/DiagnosticArray with one status."""
    pose = state.pose
    place = (pose.x_m, pose.y_m, pose.heading_rad)
    numbers = (*state.mu_x, *state.mu_y, *place, state.goal_probability)
    status = Status(
        level=_LEVELS[state.confidence],
        name=_STATE_NAME,
        message=region_name(state.region),
        hardware_id=ESTIMATOR,
        values=dict(zip(_STATE_KEYS, (repr(float(n)) for n in numbers), strict=True)),
    )
    return status_to_raw(status, stamp_ns, MAP_FRAME)


def state_from_raw(raw: bytes) -> RegionState:
    """Return the region state of a diagnostic_msgs/DiagnosticArray.

    Raises:
        MessageError: The status `region_state` or a value is missing, or no finite number.
    """
    status = _status(raw, _STATE_NAME)
    if status.level not in _CONFIDENCES:
        raise MessageError(f'level = {status.level}: must be OK, WARN or STALE')
    numbers = [_number(status.values, key) for key in _STATE_KEYS]
    left, front, right, near, medium, far, x_m, y_m, heading_rad, goal_probability = numbers
    try:
        region = parse_region(status.message)
    except ConfigurationError as error:
        raise MessageError(str(error)) from None
    return RegionState(
        region=region,
        mu_x=(left, front, right),
        mu_y=(near, medium, far),
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


def transition_to_raw(transition: Transition, stamp_ns: int) -> bytes:
    """Return a finished action as diagnostic_msgs/DiagnosticArray with one status."""
    state, next_state = region_name(transition.state), region_name(transition.next_state)
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
    return status_to_raw(status, stamp_ns)


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
