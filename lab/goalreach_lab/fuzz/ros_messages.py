"""Readers of messages, and the cores behind the nodes, fed with mutated messages."""

from array import array
from collections.abc import Callable
import math
from pathlib import Path
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan
from std_msgs.msg import Float64MultiArray

from goalreach_lab.fuzz.configurations import configuration_readers
from goalreach_lab.fuzz.mcap_layouts import layout_reader, mcap_layouts
from goalreach_lab.fuzz.reader import InvalidAcceptedError, Reader, require_finite
from goalreach_lab.fuzz.valid_inputs import bag_readers, document_readers
from goalreach_learning.controller import GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.diagnostic_messages import (
    q_table_from_raw,
    q_table_to_raw,
    state_from_raw,
    state_to_raw,
    transition_from_raw,
    transition_to_raw,
)
from goalreach_msgs_py.image_messages import image_from_raw, image_to_raw
from goalreach_msgs_py.pose_messages import (
    estimate_from_raw,
    estimate_to_raw,
    odometry_from_raw,
    odometry_to_raw,
    twist_from_raw,
    twist_to_raw,
)
from goalreach_msgs_py.sensor_messages import (
    bumpers_from_raw,
    bumpers_to_raw,
    camera_from_raw,
    camera_to_raw,
    head_from_raw,
    head_to_raw,
    landmarks_from_raw,
    landmarks_to_raw,
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
_TWIST: Final = Twist2(linear_m_per_s=0.1, steering_rad_per_s=0.1)
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
        layout_reader(folder, mcap_layouts()),
        *configuration_readers(),
        *message_readers(),
    ]


def message_readers() -> list[Reader]:
    """Return the readers of every message, and the cores behind the nodes."""
    frame = Simulator(SimulatorConfig(), np.random.default_rng(0)).sense()
    odometry = odometry_to_raw(frame.odometry, _STAMP, frame_id='odom')
    bumpers = bumpers_to_raw(frame.bumpers, _STAMP, body_radius_m=0.2, scan_time_s=0.04)
    estimate = estimate_to_raw(uniform_estimate(3.0, 5.0), _STAMP)
    q_table = q_table_to_raw(np.zeros((3, 3, 8)))
    readers = [
        _message('Odometry', Odometry, odometry, odometry_from_raw),
        _message('JointState', JointState, head_to_raw(frame.joints, _STAMP), head_from_raw),
        _message('CameraInfo', CameraInfo, camera_to_raw(frame.camera, _STAMP), camera_from_raw),
        _message('Image', Image, image_to_raw(frame.image[:8, :8], _STAMP), image_from_raw),
        _message('LaserScan of bumpers', LaserScan, bumpers, bumpers_from_raw),
        _message('TwistStamped', TwistStamped, twist_to_raw(_TWIST, _STAMP), twist_from_raw),
        _message('pose', PoseWithCovarianceStamped, estimate, estimate_from_raw),
        _message('landmarks', PolygonStamped, _landmarks(), landmarks_from_raw),
        _message('state', DiagnosticArray, state_to_raw(_state(), _STAMP), state_from_raw),
        _message('transition', DiagnosticArray, _transition(), transition_from_raw),
        _message('Q-table', Float64MultiArray, q_table, q_table_from_raw),
    ]
    return [*readers, localizer_reader(), estimator_reader(), controller_reader(), robot_reader()]


def _landmarks() -> bytes:
    seen = LandmarkObservation(u_px=10.0, v_px=20.0, peak_dn=200.0)
    return landmarks_to_raw((seen, None, seen), _STAMP)


def _state() -> RegionState:
    return StateEstimator(StateEstimatorConfig()).estimate(uniform_estimate(3.0, 5.0))


def _transition() -> bytes:
    transition = Transition(
        state=(0, 1), action=3, reward=0.0, next_state=(1, 1), temperature=0.5, trial=1, path=2,
        outcome=None,
    )  # fmt: skip
    return transition_to_raw(transition, _STAMP)


def _message(
    name: str, message_type: type[Any], valid: bytes, read: Callable[[bytes], object]
) -> Reader:
    def attempt(rng: np.random.Generator) -> object:
        found = read(mutate_message(valid, message_type, rng))
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
        'joints': (JointState, head_to_raw(frame.joints, _STAMP)),
        'odometry': (Odometry, odometry_to_raw(frame.odometry, _STAMP, frame_id='odom')),
        'camera': (CameraInfo, camera_to_raw(frame.camera, _STAMP)),
        'image': (Image, image_to_raw(frame.image, _STAMP)),
    }

    def attempt(rng: np.random.Generator) -> object:
        bad = list(valid)[rng.integers(4)]
        messages = {name: raw for name, (_, raw) in valid.items()}
        messages[bad] = mutate_message(messages[bad], valid[bad][0], rng)
        time_ns = next(ticks) * _STAMP
        image, camera = image_from_raw(messages['image']), camera_from_raw(messages['camera'])
        joints = head_from_raw(messages['joints'])
        odometry = odometry_from_raw(messages['odometry'])
        output = localizer.process(
            time_ns=time_ns, image=image, camera=camera, joints=joints, odometry=odometry
        )
        if output.mode != 'refused':
            monitor.check(
                time_ns=time_ns, image=image, camera=camera,
                odometry=odometry.pose, output=output,
            )  # fmt: skip
        require_finite(output.estimate, 'estimate')
        require_finite(localizer.head_command, 'head')
        return output

    return Reader(name='localizer, from messages', attempt=attempt)


def estimator_reader() -> Reader:
    """Return the core of the estimator, fed with mutated poses."""
    estimator = StateEstimator(StateEstimatorConfig())
    valid = estimate_to_raw(uniform_estimate(3.0, 5.0), _STAMP)

    def attempt(rng: np.random.Generator) -> object:
        raw = mutate_message(valid, PoseWithCovarianceStamped, rng)
        state = estimator.estimate(estimate_from_raw(raw))
        require_finite(state, 'state')
        if abs(sum(state.mu_x) - 1.0) > 1e-6 or not 0.0 <= state.goal_probability <= 1.0:  # noqa: PLR2004
            raise InvalidAcceptedError(f'{state}')
        return state

    return Reader(name='state estimator, from messages', attempt=attempt)


def controller_reader() -> Reader:
    """Return the core of the controller, fed with mutated states."""
    policy = Policy.unlearned(Arena().regions)
    controller = GoalReachingController(ControllerConfig(), policy, np.random.default_rng(0))
    valid, ticks = state_to_raw(_state(), _STAMP), iter(range(1, 2**62))

    def attempt(rng: np.random.Generator) -> object:
        tick = next(ticks)
        if tick % 50 == 1:
            controller.begin_path(start=None, path=tick, trial=0)
        state = state_from_raw(mutate_message(valid, DiagnosticArray, rng))
        step = controller.step(time_ns=tick * _STAMP, state=state, bumped=False)
        require_finite(step.command, 'command')
        return step

    return Reader(name='controller, from messages', attempt=attempt)


def robot_reader() -> Reader:
    """Return the core of the robot, fed with mutated commands."""
    simulator = Simulator(SimulatorConfig(), np.random.default_rng(0))
    twist = twist_to_raw(_TWIST, _STAMP)
    head = head_to_raw(simulator.sense().joints, _STAMP)

    def attempt(rng: np.random.Generator) -> object:
        if rng.random() < 0.5:  # noqa: PLR2004
            simulator.command_drive(twist_from_raw(mutate_message(twist, TwistStamped, rng)))
        else:
            simulator.command_head(head_from_raw(mutate_message(head, JointState, rng)))
        simulator.advance()
        require_finite(simulator.robot.truth, 'truth')
        require_finite(simulator.robot.turret_joint_rad, 'turret')
        return None

    return Reader(name='robot, from messages', attempt=attempt)


def mutate_message(valid: bytes, message_type: type[Any], rng: np.random.Generator) -> bytes:
    """Return a message with one to three wrong values that fit its type.

    Args:
        valid: The message, serialized.
        message_type: Its type.
        rng: Source of the mutations.
    """
    while True:
        message = deserialize_message(valid, message_type)
        for _ in range(int(rng.integers(1, 4))):
            _mutate(message, rng)
        try:
            return bytes(serialize_message(message))
        except Exception:  # noqa: BLE001, S112 - rclpy cannot send what does not fit its type
            continue


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
