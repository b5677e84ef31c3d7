"""Bad messages: every number that fits the type may come over the wire."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np

from goalreach_lab.fuzz.reader import Reader, require_finite
from goalreach_lab.fuzz.ros_breaking import bad_message
from goalreach_lab.fuzz.ros_cores import (
    controller_reader,
    estimator_reader,
    localizer_reader,
    robot_reader,
)
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
from goalreach_msgs_py.values import LandmarkObservation, RegionState, Transition
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig

_STAMP: Final = 40_000_000


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
    readers = [_message(name, sound, read) for name, sound, read in pairs]
    return [*readers, localizer_reader(), estimator_reader(), controller_reader(), robot_reader()]


def _estimate() -> Any:
    localizer = LandmarkLocalizer(LocalizerConfig())
    return localizer._anywhere  # noqa: SLF001 - a pose like any other


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


def _message(name: str, sound: Any, read: Callable[[Any], object]) -> Reader:
    def attempt(rng: np.random.Generator) -> object:
        found = read(bad_message(sound, rng))
        if name != 'landmarks':  # NaN is how an LED that is not seen is told
            require_finite(found, name)
        return found

    return Reader(name=f'message: {name}', attempt=attempt)
