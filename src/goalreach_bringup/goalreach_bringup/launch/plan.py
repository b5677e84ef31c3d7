"""Parameters of every node, from the options of a run and a parameter file."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from goalreach_bringup.launch.learning_run import LearningRun
from goalreach_bringup.launch.options import RunOptions
from goalreach_bringup.launch.path_evaluator import Progress
from goalreach_evaluation.starts import RunSeeds, random_starts
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.mission import MissionConfig
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.parameter_file import NodeParameters
from goalreach_msgs_py.parameters import build_config, flatten_config
from goalreach_msgs_py.regions import RegionConfig
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, LOCALIZER, MONITOR, RECORDER, ROBOT
from goalreach_msgs_py.values import Pose2
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.state_estimator import StateEstimatorConfig
from goalreach_sim.simulator_config import FaultParameters, SimulatorConfig, TimeConfig

_ENDLESS_STARTS = 1000
NODE_CONFIGS: dict[str, tuple[type[object], ...]] = {
    ROBOT: (SimulatorConfig, TimeConfig, RegionConfig, FaultParameters),
    LOCALIZER: (LocalizerConfig,),
    ESTIMATOR: (StateEstimatorConfig,),
    CONTROLLER: (ControllerConfig, MissionConfig),
}


def choose_starts(options: RunOptions, arena: Arena, seeds: RunSeeds) -> tuple[Pose2, ...]:
    """Return the start poses of a run.

    Raises:
        ConfigurationError: A start given as an option is not on the free floor.
    """
    for pose in options.start_poses:
        if not arena.is_free(pose.x_m, pose.y_m):
            raise ConfigurationError('--start', (pose.x_m, pose.y_m), 'on the free floor')
    if options.start_poses:
        return options.start_poses
    if options.starts == 'random':
        rng = np.random.default_rng(seeds.starts)
        return random_starts(arena, options.paths or _ENDLESS_STARTS, rng)
    if options.paths or options.learn:
        return arena.starts
    # A run without end is watched by a person: start opposite the goal, with the LEDs in view.
    half = len(arena.starts) // 2
    return arena.starts[half:] + arena.starts[:half]


def plan_parameters(
    options: RunOptions,
    *,
    arena: Arena,
    starts: Iterable[Pose2],
    policy_path: str,
    seeds: RunSeeds,
    user: NodeParameters,
    learning: LearningRun | None = None,
) -> NodeParameters:
    """Return the parameters of every node: defaults, then the user's file, then the options.

    Raises:
        ConfigurationError: A value is refused; the line names node, parameter and value.
    """
    numbers = tuple(v for p in starts for v in (p.x_m, p.y_m, p.heading_rad))
    mission = _mission(options, numbers, policy_path, seeds, learning)
    defaults = _defaults(options.noise, arena, mission, seeds)
    faults = flatten_config(FaultParameters())
    for node, values in user.items():
        known = {**defaults[node], **(faults if node == ROBOT else {}), 'use_sim_time': True}
        for name, value in values.items():
            if name not in known:
                raise ConfigurationError(f'{node}.{name}', value, 'a parameter of that node')
        defaults[node].update(values)
    defaults[ROBOT].update(_given(clock=options.clock, speed=options.speed))
    defaults[CONTROLLER].update(_given(mode=options.mode, learn=options.learn or None))
    _check(defaults)
    monitor = MONITOR if defaults[ROBOT]['clock'] == 'lockstep' else ''
    recorder = RECORDER if options.record else ''
    consumers = (defaults[ROBOT]['consumers'], monitor, recorder)
    defaults[ROBOT]['consumers'] = ','.join(filter(None, consumers))
    return defaults


def _defaults(
    noise_name: str, arena: Arena, mission: MissionConfig, seeds: RunSeeds
) -> NodeParameters:
    """Return the parameters of every node before the user's file and the options."""
    noise = noise_preset(noise_name)
    simulator = SimulatorConfig.for_arena(arena, noise)
    robot = (
        replace(simulator, start_pose=mission.starts[:3]),
        TimeConfig(seed=seeds.simulator),
        RegionConfig.for_map(arena.regions),
    )
    return {
        ROBOT: {k: v for config in robot for k, v in flatten_config(config).items()},
        LOCALIZER: flatten_config(LocalizerConfig.for_arena(arena, noise)),
        ESTIMATOR: flatten_config(StateEstimatorConfig.for_arena(arena)),
        CONTROLLER: {**flatten_config(ControllerConfig()), **flatten_config(mission)},
    }


def _mission(
    options: RunOptions,
    starts: tuple[float, ...],
    policy_path: str,
    seeds: RunSeeds,
    learning: LearningRun | None,
) -> MissionConfig:
    mission = MissionConfig(
        policy=policy_path,
        starts=starts,
        paths=options.paths,
        consumer=MONITOR,
        seed=seeds.controller,
    )
    if learning is None:
        return mission
    paths = learning.remaining(options.paths, len(starts) // 3)
    return replace(
        mission,
        policy_out=policy_path,
        first_path=learning.first_path,
        paths=learning.first_path + paths,
    )


def _given(**values: Any) -> dict[str, Any]:  # noqa: ANN401 - parameters of any type
    return {name: value for name, value in values.items() if value is not None}


def _check(parameters: NodeParameters) -> None:
    """Build every configuration once, to report a mistake before anything starts."""
    try:
        for node, configs in NODE_CONFIGS.items():
            for cls in configs:
                build_config(cls, parameters[node])
    except ConfigurationError as error:
        name = f'{node}.{error.field}'
        raise ConfigurationError(name, error.value, error.allowed) from None


_AHEAD_NS = 6_000_000_000
"""In lockstep the nodes may be a little over a hundred ticks ahead of the launcher: 4 s of the
robot's clock, which must not go back for them."""


def resume_parameters(progress: Progress, *, lockstep: bool) -> dict[str, dict[str, Any]]:
    """Return the parameters that differ from those of the start, by node.

    The controller continues the current path from the robot's pose, with the Q-table of the end of
    the last path; the robot continues at its true pose, and its clock does not go back.

    Args:
        progress: Progress of the run.
        lockstep: Whether the graph may be ahead of the launcher.
    """
    controller = {'first_path': progress.path, 'resume': progress.placed}
    changes: dict[str, dict[str, Any]] = {CONTROLLER: controller}
    if (truth := progress.truth) is not None:
        changes[ROBOT] = {
            'start_pose': (truth.x_m, truth.y_m, truth.heading_rad),
            'start_time_ns': progress.last_ns + (_AHEAD_NS if lockstep else 0),
        }
    return changes
