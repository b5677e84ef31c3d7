"""What the controller tells about learning: transitions, Q-table and path as messages."""

from __future__ import annotations

from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
import numpy as np
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import parse_region, region_name
from goalreach_msgs_py.ros.common_messages import (
    MessageError,
    header,
    pose_to_msg,
    require_finite,
    stamp_to_msg,
)
from goalreach_msgs_py.ros.estimate_messages import diagnostic_values
from goalreach_msgs_py.topics import MAP_FRAME
from goalreach_msgs_py.values import FloatArray, PathOutcome, Pose2, Transition

TRANSITION_NAME = 'transition'
_Q_LABELS = ('x', 'y', 'action')


def transition_to_msg(transition: Transition, stamp_ns: int) -> DiagnosticArray:
    """Return a finished action as diagnostic_msgs/DiagnosticArray with one status."""
    values = {
        'state': region_name(transition.state),
        'action': str(transition.action),
        'reward': repr(transition.reward),
        'next_state': region_name(transition.next_state),
        'temperature': repr(transition.temperature),
        'trial': str(transition.trial),
        'path': str(transition.path),
        'outcome': '' if transition.outcome is None else transition.outcome.value,
    }
    status = DiagnosticStatus(
        level=DiagnosticStatus.OK,
        name=TRANSITION_NAME,
        message=f'{values["state"]} -> {values["next_state"]}',
        hardware_id='goal_reaching_controller',
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
    message = DiagnosticArray(status=[status])
    message.header.stamp = stamp_to_msg(stamp_ns)
    return message


def transition_from_msg(message: DiagnosticArray) -> Transition:
    """Return the finished action of a diagnostic_msgs/DiagnosticArray.

    Raises:
        MessageError: A value is missing or cannot be read.
    """
    status = next((s for s in message.status if s.name == TRANSITION_NAME), None)
    if status is None:
        raise MessageError(f'status without the name {TRANSITION_NAME}')
    values = diagnostic_values(status)
    try:
        return Transition(
            state=parse_region(values['state']),
            action=int(values['action']),
            reward=require_finite('reward', values['reward']),
            next_state=parse_region(values['next_state']),
            temperature=require_finite('temperature', values['temperature']),
            trial=int(values['trial']),
            path=int(values['path']),
            outcome=PathOutcome(values['outcome']) if values['outcome'] else None,
        )
    except KeyError as error:
        raise MessageError(f'values without {error.args[0]}') from None
    except (ValueError, ConfigurationError) as error:
        raise MessageError(f'values: {error}') from None


def q_table_to_msg(q: FloatArray) -> Float64MultiArray:
    """Return Q-values (3, 3, 8) as std_msgs/Float64MultiArray with dimensions x, y, action."""
    message = Float64MultiArray(data=np.ascontiguousarray(q, dtype=np.float64).ravel().tolist())
    remaining = q.size
    for label, size in zip(_Q_LABELS, q.shape, strict=True):
        message.layout.dim.append(MultiArrayDimension(label=label, size=size, stride=remaining))
        remaining //= size
    return message


def q_table_from_msg(message: Float64MultiArray) -> FloatArray:
    """Return the Q-values of a std_msgs/Float64MultiArray.

    Raises:
        MessageError: The dimensions are not x, y, action or do not fit the data, or a value is
            not finite.
    """
    labels = tuple(dimension.label for dimension in message.layout.dim)
    shape = tuple(dimension.size for dimension in message.layout.dim)
    if labels != _Q_LABELS or np.prod(shape) != len(message.data):
        raise MessageError(f'layout {labels} {shape}: must be {_Q_LABELS} and fit the data')
    q = np.array(message.data, dtype=np.float64).reshape(shape)
    if not np.isfinite(q).all():
        raise MessageError('data holds a number that is not finite')
    return q


def path_to_msg(poses: Sequence[tuple[int, Pose2]], stamp_ns: int) -> Path:
    """Return (stamp in ns, pose in `map`) pairs as nav_msgs/Path."""
    message = Path(header=header(stamp_ns, MAP_FRAME))
    message.poses = [
        PoseStamped(header=header(when, MAP_FRAME), pose=pose_to_msg(pose)) for when, pose in poses
    ]
    return message
