"""Readers of messages, and the cores behind the nodes, fed with mutated messages."""

from __future__ import annotations

from array import array
from collections.abc import Callable
import math
from pathlib import Path
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

from goalreach_lab.fuzz.configurations import configuration_readers
from goalreach_lab.fuzz.reader import InvalidAcceptedError, Reader, require_finite
from goalreach_lab.fuzz.valid_inputs import bag_readers, document_readers
from goalreach_learning.controller import GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.ros.common_messages import twist_from_msg, twist_to_msg
from goalreach_msgs_py.ros.estimate_messages import (
    estimate_from_msg,
    estimate_to_msg,
    landmarks_from_msg,
    landmarks_to_msg,
    state_from_msg,
    state_to_msg,
)
from goalreach_msgs_py.ros.learning_messages import (
    q_table_from_msg,
    q_table_to_msg,
    transition_from_msg,
    transition_to_msg,
)
from goalreach_msgs_py.ros.sensor_messages import (
    bumpers_from_msg,
    bumpers_to_msg,
    camera_from_msg,
    camera_to_msg,
    head_from_msg,
    head_to_msg,
    image_from_msg,
    image_to_msg,
    odometry_from_msg,
    odometry_to_msg,
)
from goalreach_msgs_py.values import LandmarkObservation, RegionState, Transition, Twist2
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import uniform_estimate
from goalreach_perception.sensor_monitor import SensorMonitor
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig

_STAMP: Final = 40_000_000
_FLOATS: Final = (
    0.0, -0.0, 1.0, -1.0, math.pi, 1e-320, 1e9, -1e9, 1e16, 1e300, -1e300, 1.7e308, math.nan,
    math.inf, -math.inf,
)  # fmt: skip
_TEXTS: Final = ('', 'nan', 'inf', '-1e400', '1', 'x', '\0', '\n', 'FRONT/NEAR', 'a' * 3000)
_MOSTLY: Final = 0.6


def all_readers(folder: Path) -> list[Reader]:
    """Return every reader under test.

    Args:
        folder: Folder of the mutated files.
    """
    return [
        *document_readers(folder),
        *bag_readers(folder),
        *configuration_readers(),
        *message_readers(),
    ]


def message_readers() -> list[Reader]:
    """Return the readers of every message, and the cores behind the nodes."""
    frame = Simulator(SimulatorConfig(), np.random.default_rng(0)).sense()
    pairs: list[tuple[str, Any, Callable[[Any], object]]] = [
        ('Odometry', odometry_to_msg(frame.odometry, _STAMP, frame_id='odom'), odometry_from_msg),
        ('JointState', head_to_msg(frame.joints, _STAMP), head_from_msg),
        ('CameraInfo', camera_to_msg(frame.camera, _STAMP), camera_from_msg),
        ('Image', image_to_msg(frame.image[:8, :8].copy(), _STAMP), image_from_msg),
        (
            'LaserScan of bumpers',
            bumpers_to_msg(frame.bumpers, _STAMP, body_radius_m=0.2, scan_time_s=0.04),
            bumpers_from_msg,
        ),
        ('TwistStamped', twist_to_msg(frame.odometry.twist, _STAMP), twist_from_msg),
        ('pose', estimate_to_msg(_estimate(), _STAMP), estimate_from_msg),
        ('landmarks', _landmarks(), landmarks_from_msg),
        ('state', state_to_msg(_state(), _STAMP), state_from_msg),
        ('transition', _transition(), transition_from_msg),
        ('Q-table', q_table_to_msg(np.zeros((3, 3, 8))), q_table_from_msg),
    ]
    readers = [_message(name, valid, read) for name, valid, read in pairs]
    return [*readers, localizer_reader(), estimator_reader(), controller_reader(), robot_reader()]


def _estimate() -> Any:
    localizer = LandmarkLocalizer(LocalizerConfig())
    return localizer._uniform  # noqa: SLF001 - any valid pose


def _landmarks() -> Any:
    seen = LandmarkObservation(u_px=10.0, v_px=20.0, peak_dn=200.0)
    return landmarks_to_msg((seen, None, seen), _STAMP)


def _state() -> RegionState:
    return StateEstimator(StateEstimatorConfig()).estimate(_estimate())


def _transition() -> DiagnosticArray:
    transition = Transition(
        state=(0, 1), action=3, reward=0.0, next_state=(1, 1), temperature=0.5, trial=1, path=2,
        outcome=None,
    )  # fmt: skip
    return transition_to_msg(transition, _STAMP)


def _message(name: str, valid: Any, read: Callable[[Any], object]) -> Reader:
    def attempt(rng: np.random.Generator) -> object:
        found = read(mutate_message(valid, rng))
        if name != 'landmarks':  # NaN marks an LED that is not seen
            require_finite(found, name)
        return found

    return Reader(name=f'message: {name}', attempt=attempt)


def localizer_reader() -> Reader:
    """Return the core of the localizer, fed with messages of which one is mutated."""
    frame = Simulator(SimulatorConfig(), np.random.default_rng(0)).sense()
    config = LocalizerConfig()
    localizer, monitor = LandmarkLocalizer(config), SensorMonitor(config)
    ticks = iter(range(1, 2**62))
    valid = {
        'joints': head_to_msg(frame.joints, _STAMP),
        'odometry': odometry_to_msg(frame.odometry, _STAMP, frame_id='odom'),
        'camera': camera_to_msg(frame.camera, _STAMP),
        'image': image_to_msg(frame.image, _STAMP),
    }

    def attempt(rng: np.random.Generator) -> object:
        bad = list(valid)[rng.integers(4)]
        messages = {n: mutate_message(m, rng) if n == bad else m for n, m in valid.items()}
        time_ns = next(ticks) * _STAMP
        image, camera = image_from_msg(messages['image']), camera_from_msg(messages['camera'])
        joints = head_from_msg(messages['joints'])
        odometry = odometry_from_msg(messages['odometry'])
        output = localizer.process(
            time_ns=time_ns, image=image, camera=camera, joints=joints, odometry=odometry
        )
        if output.mode != 'refused':
            monitor.check(
                time_ns=time_ns, image=image, camera=camera, joints=joints,
                odometry=odometry.pose, output=output,
            )  # fmt: skip
        require_finite(output.estimate, 'estimate')
        require_finite(output.head_command, 'head')
        return output

    return Reader(name='localizer, from messages', attempt=attempt)


def estimator_reader() -> Reader:
    """Return the core of the estimator, fed with mutated poses."""
    estimator, valid = (
        StateEstimator(StateEstimatorConfig()),
        estimate_to_msg(uniform_estimate(3.0, 5.0), _STAMP),
    )

    def attempt(rng: np.random.Generator) -> object:
        state = estimator.estimate(estimate_from_msg(mutate_message(valid, rng)))
        require_finite(state, 'state')
        if abs(sum(state.mu_x) - 1.0) > 1e-6 or not 0.0 <= state.goal_probability <= 1.0:  # noqa: PLR2004
            raise InvalidAcceptedError(f'{state}')
        return state

    return Reader(name='state estimator, from messages', attempt=attempt)


def controller_reader() -> Reader:
    """Return the core of the controller, fed with mutated states."""
    estimator = StateEstimator(StateEstimatorConfig())
    policy = Policy.unlearned(Arena().regions)
    controller = GoalReachingController(ControllerConfig(), policy, np.random.default_rng(0))
    valid, ticks = (
        state_to_msg(estimator.estimate(uniform_estimate(3.0, 5.0)), _STAMP),
        iter(range(1, 2**62)),
    )

    def attempt(rng: np.random.Generator) -> object:
        tick = next(ticks)
        if tick % 50 == 1:
            controller.begin_path(start=None, path=tick, trial=0)
        state = state_from_msg(mutate_message(valid, rng))
        step = controller.step(time_ns=tick * _STAMP, state=state, bumped=False)
        require_finite(step.command, 'command')
        return step

    return Reader(name='controller, from messages', attempt=attempt)


def robot_reader() -> Reader:
    """Return the core of the robot, fed with mutated commands."""
    simulator = Simulator(SimulatorConfig(), np.random.default_rng(0))
    twist = twist_to_msg(Twist2(linear_m_per_s=0.1, steering_rad_per_s=0.1), _STAMP)
    head = head_to_msg(simulator.sense().joints, _STAMP)

    def attempt(rng: np.random.Generator) -> object:
        if rng.random() < 0.5:  # noqa: PLR2004
            simulator.command_drive(twist_from_msg(mutate_message(twist, rng)))
        else:
            simulator.command_head(head_from_msg(mutate_message(head, rng)))
        simulator.advance()
        require_finite(simulator.robot.truth, 'truth')
        require_finite(simulator.robot.turret_joint_rad, 'turret')
        return None

    return Reader(name='robot, from messages', attempt=attempt)


def mutate_message(valid: Any, rng: np.random.Generator) -> Any:
    """Return a copy of a message with one to three wrong values that fit its type."""
    message = _copy(valid)
    for _ in range(int(rng.integers(1, 4))):
        _mutate(message, rng)
    return message


def _mutate(message: Any, rng: np.random.Generator) -> None:
    """Put a wrong value into one field, at any depth."""
    names = list(message.get_fields_and_field_types())
    name = names[rng.integers(len(names))]
    value = getattr(message, name)
    if hasattr(value, 'get_fields_and_field_types'):
        _mutate(value, rng)
    elif isinstance(value, bool):
        setattr(message, name, not value)
    elif isinstance(value, int):
        _set_first(message, name, rng.permutation([0, 1, -1, 127, 255, 65535, 2**31, 2**32 - 1]))
    elif isinstance(value, float):
        _set_first(message, name, [_FLOATS[rng.integers(len(_FLOATS))]])
    elif isinstance(value, bytes):
        _set_first(message, name, [rng.bytes(1)])
    elif isinstance(value, str):
        _set_first(message, name, [_TEXTS[rng.integers(len(_TEXTS))]])
    else:
        _mutate_sequence(value, rng)


def _set_first(message: Any, name: str, values: Any) -> None:
    """Set a field to the first of some values that its type takes."""
    for value in values:
        try:
            setattr(message, name, value.item() if isinstance(value, np.generic) else value)
        except (AssertionError, TypeError):
            continue
        return


def _holds_floats(value: Any, rng: np.random.Generator) -> bool:
    """Return whether a sequence is one of floats, most of the time."""
    return isinstance(value, array) and value.typecode in 'fd' and bool(rng.random() < _MOSTLY)


def _mutate_sequence(value: Any, rng: np.random.Generator) -> None:
    if not len(value):
        return
    index = int(rng.integers(len(value)))
    element = value[index]
    if hasattr(element, 'get_fields_and_field_types') and rng.random() < 0.8:  # noqa: PLR2004
        _mutate(element, rng)
    elif isinstance(value, np.ndarray) or _holds_floats(value, rng):
        value[index] = _FLOATS[rng.integers(len(_FLOATS))]
    elif rng.random() < 0.5:  # noqa: PLR2004
        del value[index]
    else:
        value.append(element)


def _copy(message: Any) -> Any:
    return deserialize_message(serialize_message(message), type(message))
