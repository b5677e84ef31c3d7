"""Parameters of every node, from options, a parameter file, and external nodes."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from goalreach_bringup.launch.learning_run import LearningRun
from goalreach_bringup.launch.options import RunOptions
from goalreach_bringup.launch.path_evaluator import Progress
from goalreach_evaluation.choices import choose_arena, choose_policy
from goalreach_evaluation.starts import random_starts
from goalreach_learning.behaviors import GOAL
from goalreach_learning.controller_config import ControllerConfig, MissionConfig, RobotConfig
from goalreach_learning.policy_file import find_policy
from goalreach_msgs_py import topics
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.parameter_file import NodeParameters, read_parameters
from goalreach_msgs_py.parameters import build_config, flatten_config, parameter_infos
from goalreach_msgs_py.regions import RegionConfig
from goalreach_msgs_py.values import Pose2
from goalreach_perception.localizer_config import InputConfig, LocalizerConfig
from goalreach_perception.state_estimator import StateEstimatorConfig
from goalreach_sim.simulator_config import FaultParameters, SimulatorConfig, TimeConfig

RESTARTED_NS: Final = 100_000_000
"""Stamps that go back by more are those of a restarted clock. Chosen."""
_STOP_AFTER_S: Final = 0.5
"""Silence after which a robot of others is commanded to stand: the watchdog of ours. Chosen."""
_ENDLESS_STARTS = 1000
_STANDARD = ('use_sim_time', 'qos_overrides.', 'start_type_description_service')
"""Beginnings of parameters that nodes have besides those of their configurations."""
NODE_CONFIGS: dict[str, tuple[type[object], ...]] = {
    topics.ROBOT: (SimulatorConfig, TimeConfig, RegionConfig, FaultParameters),
    topics.LOCALIZER: (LocalizerConfig, InputConfig),
    topics.ESTIMATOR: (StateEstimatorConfig,),
    topics.CONTROLLER: (ControllerConfig, RobotConfig, MissionConfig),
}
_BY_OPTIONS: Final = {
    topics.ROBOT: {'seed', 'start_pose'},
    topics.CONTROLLER: {*parameter_infos(MissionConfig)} - {'consumer'},
}
"""Parameters that the options alone decide, so that the file of one run fits another."""


def choose_starts(options: RunOptions, arena: Arena) -> tuple[Pose2, ...]:
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
        rng = np.random.default_rng(options.seeds.starts)
        count = len(arena.starts) if options.learn else options.paths or _ENDLESS_STARTS
        return random_starts(arena, count, rng)
    if options.paths or options.learn:
        return arena.starts
    # A run without end is watched by a person: start opposite the goal, with the LEDs in view.
    half = len(arena.starts) // 2
    return arena.starts[half:] + arena.starts[:half]


def require_known(user: NodeParameters) -> NodeParameters:
    """Return the parameters of a user's file.

    Raises:
        ConfigurationError: A name is none of a parameter of its node.
    """
    for node, values in user.items():
        known = {name for cls in NODE_CONFIGS[node] for name in parameter_infos(cls)}
        for name, value in values.items():
            if name not in known and not name.startswith(_STANDARD):
                raise ConfigurationError(f'{node}.{name}', value, 'a parameter of that node')
    return user


def plan_parameters(
    options: RunOptions,
    *,
    arena: Arena,
    starts: Iterable[Pose2],
    policy_path: str,
    user: NodeParameters,
    learning: LearningRun | None = None,
) -> NodeParameters:
    """Return the parameters of every node: defaults, then the user's file, then the options.

    Raises:
        ConfigurationError: A value is refused; the line names node, parameter and value.
    """
    defaults = _defaults(options, arena, starts, policy_path, learning)
    for node, values in require_known(user).items():
        owned = _BY_OPTIONS.get(node, ())
        defaults[node] |= {name: value for name, value in values.items() if name not in owned}
    defaults[topics.ROBOT].update(_given(clock=options.clock, speed=options.speed))
    learner = learning.learner if learning else None
    given = _given(mode=options.mode, behaviors=options.behaviors, learn=options.learn or None)
    defaults[topics.CONTROLLER].update(given | _given(learner=learner))
    _check(defaults)
    defaults[topics.ROBOT]['sonar'] |= defaults[topics.CONTROLLER]['behaviors'] != GOAL
    return defaults


def standalone_parameters(options: RunOptions) -> NodeParameters:
    """Return the parameters of nodes that no launcher waits for, judges or records.

    Raises:
        GoalreachError: An option, a file or a value is refused.
    """
    arena, name = choose_arena(options.arena), options.policy or 'paper'
    choose_policy(name, arena)  # refuses one of other regions
    return plan_parameters(
        options,
        arena=arena,
        starts=choose_starts(options, arena),
        policy_path=str(find_policy(name).resolve()),
        user=read_parameters(options.params_file, options.namespace),
    )


def _defaults(
    options: RunOptions,
    arena: Arena,
    starts: Iterable[Pose2],
    policy_path: str,
    learning: LearningRun | None,
) -> NodeParameters:
    """Return the parameters of every node before the user's file and the options."""
    numbers = tuple(v for p in starts for v in (p.x_m, p.y_m, p.heading_rad))
    first = learning.first_path if learning else 0
    paths = learning.remaining(options.paths, len(numbers) // 3) if learning else options.paths
    mission = MissionConfig(
        policy=policy_path, policy_out=policy_path if learning else '',
        starts=numbers, first_path=first, paths=first + paths,
        paths_per_trial=len(numbers) // 3, seed=options.seeds.controller,
    )  # fmt: skip
    noise = noise_preset(options.noise)
    configs: dict[str, tuple[object, ...]] = {
        topics.ROBOT: (
            replace(SimulatorConfig.for_arena(arena, noise), start_pose=numbers[:3]),
            TimeConfig(seed=options.seeds.simulator),
            RegionConfig.for_map(arena.regions),
        ),
        topics.LOCALIZER: (LocalizerConfig.for_arena(arena, noise), InputConfig()),
        topics.ESTIMATOR: (StateEstimatorConfig.for_arena(arena),),
        topics.CONTROLLER: (ControllerConfig(), RobotConfig(), mission),
    }
    return {
        node: {name: value for one in ones for name, value in flatten_config(one).items()}
        for node, ones in configs.items()
    }


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
    """
    controller = {'first_path': progress.path, 'resume': progress.placed}
    changes: dict[str, dict[str, Any]] = {topics.CONTROLLER: controller}
    if (truth := progress.truth) is not None:
        changes[topics.ROBOT] = {
            'start_pose': (truth.x_m, truth.y_m, truth.heading_rad),
            'start_time_ns': progress.last_ns + (_AHEAD_NS if lockstep else 0),
        }
    return changes


@dataclass(frozen=True, kw_only=True)
class ExternalNodes:
    """What is known of the external nodes when a run begins.

    Attributes:
        names: The nodes of ours that others replace.
        has_reset: Whether the robot has the services that place it.
        has_truth: Whether the true pose is published.
        only_drives: Whether a node of another name sends the commands: our controller then keeps
            the paths, disconnected from the robot.
    """

    names: tuple[str, ...] = ()
    has_reset: bool = True
    has_truth: bool = True
    only_drives: bool = False

    @property
    def started(self) -> tuple[str, ...]:
        """The nodes that the launcher starts."""
        return tuple(
            name
            for name in topics.NODES
            if name not in self.names or (name == topics.CONTROLLER and self.only_drives)
        )

    def is_placed(self, placement_service: str) -> bool:
        """Return whether our controller places the robot at the start poses."""
        return self.has_reset and not placement_service

    def parameters(self, planned: NodeParameters, options: RunOptions) -> NodeParameters:
        """Return the planned parameters, changed for what else takes part in this run."""
        lockstep = planned[topics.ROBOT]['clock'] == 'lockstep'
        changes: dict[str, Any] = {'consumer': topics.MONITOR}
        if not self.is_placed(options.placement_service):
            changes |= {'starts': (), 'placement_service': options.placement_service}
        if topics.ROBOT in self.names and not lockstep:
            changes['stop_after_s'] = planned[topics.CONTROLLER]['stop_after_s'] or _STOP_AFTER_S
        if options.no_drive:
            changes['stamped_cmd_vel'] = True  # only people read it
        consumers = (
            planned[topics.ROBOT]['consumers'],
            topics.MONITOR if lockstep else '',
            topics.RECORDER if options.record else '',
            topics.CONTROLLER if lockstep and self.only_drives else '',  # another commands
        )
        robot = {**planned[topics.ROBOT], 'consumers': ','.join(filter(None, consumers))}
        controller = {**planned[topics.CONTROLLER], **changes}
        return {**planned, topics.ROBOT: robot, topics.CONTROLLER: controller}

    def remaps(self, *, drive: bool) -> tuple[str, ...]:
        """Return the remapping rules of the nodes."""
        if drive and not self.only_drives:
            return ()
        names = map(topics.relative_name, (topics.CMD_VEL, topics.DISCONNECTED_CMD_VEL))
        return (f'{topics.CONTROLLER}:{":=".join(names)}',)

    def lines(self, placement_service: str) -> list[str]:
        """Return messages for the user before the robot moves."""
        messages = [f'{name} (external) is there' for name in self.names]
        if self.only_drives:
            messages.append(f'another node drives; our {topics.CONTROLLER} keeps the paths')
        if placement_service:
            messages.append(f'{placement_service} places the robot for each path')
        elif not self.has_reset:
            messages.append(f'no {topics.RESET_SERVICE}: the robot drives from where it stands')
        if not self.has_truth:
            messages.append(
                f'no {topics.GROUND_TRUTH}: paths that end in the goal are declared, not judged'
            )
        return messages
