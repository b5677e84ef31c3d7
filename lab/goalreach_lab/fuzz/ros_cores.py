"""The cores behind the nodes, fed with bad messages that pass the first look."""

from __future__ import annotations

import numpy as np

from goalreach_lab.fuzz.reader import Nonsense, Reader, require_finite
from goalreach_lab.fuzz.ros_breaking import bad_message
from goalreach_learning.controller import GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.ros.common_messages import twist_from_msg, twist_to_msg
from goalreach_msgs_py.ros.estimate_messages import (
    estimate_from_msg,
    estimate_to_msg,
    state_from_msg,
    state_to_msg,
)
from goalreach_msgs_py.ros.sensor_messages import (
    camera_from_msg,
    camera_to_msg,
    head_from_msg,
    head_to_msg,
    image_from_msg,
    image_to_msg,
    odometry_from_msg,
    odometry_to_msg,
)
from goalreach_msgs_py.values import Twist2
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import uniform_estimate
from goalreach_perception.sensor_monitor import SensorMonitor
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig

_STAMP = 40_000_000


def localizer_reader() -> Reader:
    """Return the localizer's core, fed with messages of which one is bad."""
    frame = Simulator(SimulatorConfig(), np.random.default_rng(0)).sense()
    config = LocalizerConfig()
    localizer, monitor = LandmarkLocalizer(config), SensorMonitor(config)
    ticks = iter(range(1, 2**62))
    sounds = {
        'joints': head_to_msg(frame.joints, _STAMP),
        'odometry': odometry_to_msg(frame.odometry, _STAMP, frame_id='odom'),
        'camera': camera_to_msg(frame.camera, _STAMP),
        'image': image_to_msg(frame.image, _STAMP),
    }

    def attempt(rng: np.random.Generator) -> object:
        bad = list(sounds)[rng.integers(4)]
        messages = {n: bad_message(m, rng) if n == bad else m for n, m in sounds.items()}
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
    """Return the core of the estimator, fed with bad poses."""
    estimator, sound = (
        StateEstimator(StateEstimatorConfig()),
        estimate_to_msg(uniform_estimate(3.0, 5.0), _STAMP),
    )

    def attempt(rng: np.random.Generator) -> object:
        state = estimator.estimate(estimate_from_msg(bad_message(sound, rng)))
        require_finite(state, 'state')
        if abs(sum(state.mu_x) - 1.0) > 1e-6 or not 0.0 <= state.goal_probability <= 1.0:  # noqa: PLR2004
            raise Nonsense(f'{state}')
        return state

    return Reader(name='state estimator, from messages', attempt=attempt)


def controller_reader() -> Reader:
    """Return the core of the controller, fed with bad states."""
    estimator = StateEstimator(StateEstimatorConfig())
    policy = Policy.unlearned(Arena().regions)
    controller = GoalReachingController(ControllerConfig(), policy, np.random.default_rng(0))
    sound, ticks = (
        state_to_msg(estimator.estimate(uniform_estimate(3.0, 5.0)), _STAMP),
        iter(range(1, 2**62)),
    )

    def attempt(rng: np.random.Generator) -> object:
        tick = next(ticks)
        if tick % 50 == 1:
            controller.begin_path(start=None, path=tick, trial=0)
        state = state_from_msg(bad_message(sound, rng))
        step = controller.step(time_ns=tick * _STAMP, state=state, bumped=False)
        require_finite(step.command, 'command')
        return step

    return Reader(name='controller, from messages', attempt=attempt)


def robot_reader() -> Reader:
    """Return the core of the robot, fed with bad commands."""
    simulator = Simulator(SimulatorConfig(), np.random.default_rng(0))
    twist = twist_to_msg(Twist2(linear_m_per_s=0.1, steering_rad_per_s=0.1), _STAMP)
    head = head_to_msg(simulator.sense().joints, _STAMP)

    def attempt(rng: np.random.Generator) -> object:
        if rng.random() < 0.5:  # noqa: PLR2004
            simulator.command_drive(twist_from_msg(bad_message(twist, rng)))
        else:
            simulator.command_head(head_from_msg(bad_message(head, rng)))
        simulator.advance()
        require_finite(simulator.robot.truth, 'truth')
        require_finite(simulator.robot.turret_joint_rad, 'turret')
        return None

    return Reader(name='robot, from messages', attempt=attempt)
