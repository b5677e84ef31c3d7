"""The paper's learning phase: trials of paths from every start, in one process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from goalreach_learning.environment import OptionEnvironment
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig, QLearner
from goalreach_learning.task import BUMP_REWARD, GOAL_REWARD
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.values import Pose2

MAX_GREEDY_OPTIONS = 30
"""Actions after which a greedy path counts as lost; chosen, nine regions need far fewer."""

_DEFAULT = LearningConfig()


@dataclass(frozen=True, kw_only=True)
class TrainingResult:
    """What a learning phase yields.

    Attributes:
        policy: What was learned.
        success_by_trial: Share of the paths of each trial, exploring, that reached the goal.
        options: Actions taken in all.
        length_m: Length driven in all, metres.
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
) -> TrainingResult:
    """Run a learning phase: `config.trials` trials, each with one path from every start.

    Args:
        arena: Walls, regions and starts.
        config: The free parameters.
        rng: Source of all chance.
        on_trial: Called after every trial with its number, from 0, and what is known then.
    """
    environment = OptionEnvironment(arena, overshoot_m=config.overshoot_m)
    learner = QLearner(config, arena.regions)
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
    """Learn along one path; return whether it reached the goal, its actions and its metres."""
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
    """Return the start moved at random, kept on the free floor."""
    if jitter_m == 0.0:
        return start.x_m, start.y_m
    x_m = start.x_m + (2.0 * rng.random() - 1.0) * jitter_m
    y_m = start.y_m + (2.0 * rng.random() - 1.0) * jitter_m
    (x_low, x_high), (y_low, y_high) = environment.x_contacts_m, environment.y_contacts_m
    return min(max(x_m, x_low), x_high), min(max(y_m, y_low), y_high)


def greedy_successes(
    arena: Arena, policy: Policy, *, overshoot_m: float = 0.0
) -> tuple[bool, ...]:
    """Return, for each start, whether the best actions lead from it to the goal.

    Args:
        arena: Walls, regions and starts.
        policy: What to follow.
        overshoot_m: Distance driven past a border before the next action, metres.
    """
    environment = OptionEnvironment(arena, overshoot_m=overshoot_m)
    return tuple(_greedy_success(environment, policy, start) for start in arena.starts)


def _greedy_success(environment: OptionEnvironment, policy: Policy, start: Pose2) -> bool:
    x_m, y_m = start.x_m, start.y_m
    region = policy.regions.region_at(x_m, y_m)
    for _ in range(MAX_GREEDY_OPTIONS):
        action = policy.greedy_action(region)
        if region == policy.regions.goal or action is None:
            break
        x_m, y_m, region, bumped, _ = environment.advance(x_m, y_m, region, action)
        if bumped:
            return False
    return region == policy.regions.goal
