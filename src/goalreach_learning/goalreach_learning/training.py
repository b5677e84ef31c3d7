"""The paper's learning phase: trials of paths from every start, without simulating time."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from goalreach_learning.environment import OptionEnvironment
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig, QLearner
from goalreach_learning.task import BUMP_REWARD, GOAL_REWARD
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import Pose2

_DEFAULT = LearningConfig()


@dataclass(frozen=True, kw_only=True)
class TrainingResult:
    """The result of a learning phase.

    Attributes:
        policy: The learned policy.
        success_by_trial: Fraction of the exploring paths of each trial that reached the goal.
        options: Total number of actions.
        length_m: Total length driven, metres.
    """

    policy: Policy
    success_by_trial: tuple[float, ...]
    options: int
    length_m: float


def train(
    arena: Arena,
    config: LearningConfig = _DEFAULT,
    *,
    rng: np.random.Generator,
    on_trial: Callable[[int, Policy], object] | None = None,
    learner: QLearner | None = None,
) -> TrainingResult:
    """Run a learning phase: `config.trials` trials, each with one path from every start.

    Args:
        arena: Walls, regions and starts.
        config: Parameters of the learner.
        rng: Generator of starts and actions.
        on_trial: Called after every trial with its number, from 0, and the policy so far.
        learner: Learner of the same configuration to continue with; None for a new one.
    """
    environment = OptionEnvironment(arena, overshoot_m=config.overshoot_m)
    learner = learner or QLearner(config, arena.regions)
    success: list[float] = []
    options, length_m = 0, 0.0
    for trial in range(config.trials):
        temperature = config.temperature(trial)
        goals = 0
        for start in arena.starts:
            reached, count, path_m = _run_path(environment, learner, start, temperature, rng)
            goals += reached
            options += count
            length_m += path_m
        success.append(goals / len(arena.starts))
        if on_trial is not None:
            on_trial(trial, learner.policy())
    return TrainingResult(
        policy=learner.policy(),
        success_by_trial=tuple(success),
        options=options,
        length_m=length_m,
    )


def _run_path(
    environment: OptionEnvironment,
    learner: QLearner,
    start: Pose2,
    temperature: float,
    rng: np.random.Generator,
) -> tuple[bool, int, float]:
    """Learn along one path; return whether it reached the goal, its actions and its length."""
    goal = learner.regions.goal
    x_m, y_m = _jittered(environment, start, learner.config.start_jitter_m, rng)
    region = learner.regions.region_at(x_m, y_m)
    if region == goal:
        return True, 0, 0.0
    length_m = 0.0
    for count in range(1, learner.config.max_options + 1):
        action = learner.choose(region, temperature, rng.random())
        x_m, y_m, next_region, bumped, step_m = environment.advance(x_m, y_m, region, action)
        length_m += step_m
        reached = not bumped and next_region == goal
        reward = GOAL_REWARD if reached else BUMP_REWARD if bumped else 0.0
        learner.update(region, action, reward, next_region, terminal=reached or bumped)
        if reached or bumped:
            return reached, count, length_m
        region = next_region
    return False, learner.config.max_options, length_m


def _jittered(
    environment: OptionEnvironment, start: Pose2, jitter_m: float, rng: np.random.Generator
) -> tuple[float, float]:
    """Return the start moved at random within the free floor."""
    if jitter_m == 0.0:
        return start.x_m, start.y_m
    x_m = start.x_m + (2.0 * rng.random() - 1.0) * jitter_m
    y_m = start.y_m + (2.0 * rng.random() - 1.0) * jitter_m
    return environment.clamp(x_m, y_m)
