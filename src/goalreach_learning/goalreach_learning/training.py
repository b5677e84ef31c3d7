"""Learning phases in one process: trials of paths from every start, without simulating time."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from goalreach_learning.kinematic_drive import OptionEnvironment
from goalreach_learning.learner import Agent, Experience, Situation
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.arena import Arena, paper_starts
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import PathOutcome, Pose2, Region

_DEFAULT = LearningConfig()

LearnedPath = tuple[PathOutcome, int, float]
"""How a path ended, its number of options, and its length in metres."""


class TrainingResult(NamedTuple):
    """The result of a learning phase.

    Attributes:
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
    agent: Agent | None = None,
) -> TrainingResult:
    """Run a learning phase: `config.trials` trials, each with one path from every start.

    Args:
        arena: Walls, regions and starts.
        config: Parameters of the learner.
        rng: Generator of starts and actions.
        on_trial: Called after every trial with its number, from 0, and the policy so far.
        agent: Who learns, by the same configuration; None for the paper's learner.

    Raises:
        ConfigurationError: A learner answers with what is no action.
    """
    phase = LearningPhase(arena, config, agent or Agent('paper', arena.regions, config, rng), rng)
    success: list[float] = []
    options, length_m = 0, 0.0
    for trial in range(config.trials):
        goals = 0
        for number, start in enumerate(arena.starts):
            outcome, count, path_m = phase.run(start, trial, trial * len(arena.starts) + number)
            goals += outcome is PathOutcome.GOAL
            options += count
            length_m += path_m
        success.append(goals / len(arena.starts))
        if on_trial is not None:
            on_trial(trial, phase.agent.policy)
    return TrainingResult(phase.agent.policy, tuple(success), options, length_m)


def policy_for_goal(policy: Policy, goal: Region, rng: np.random.Generator) -> Policy:
    """Return a policy for another goal on the same floor, learned there as the paper does.

    Raises:
        ConfigurationError: The robot cannot enter that region.
    """
    if goal == policy.regions.goal:
        return policy
    forbidden = tuple(region for region in policy.regions.forbidden if region != goal)
    regions = replace(policy.regions, goal=goal, forbidden=forbidden)
    return train(arena_of(regions), rng=rng).policy


def arena_of(regions: RegionMap) -> Arena:
    """Return an arena of these regions to learn in, with starts along its border."""
    size: dict[str, Any] = {'width_m': regions.x_knots_m[-1], 'length_m': regions.y_knots_m[-1]}
    leds_m = tuple((share * size['width_m'], 0.0, 1.0) for share in (0.2, 0.5, 0.8))
    return Arena(**size, landmarks_m=leds_m, regions=regions, starts=paper_starts(regions))


@dataclass
class LearningPhase:
    """Paths of a learner in one process, without simulating time.

    The generator draws the starts, and the actions of the paper's learner.
    """

    arena: Arena
    config: LearningConfig
    agent: Agent
    rng: np.random.Generator

    def __post_init__(self) -> None:
        self._environment = OptionEnvironment(self.arena, overshoot_m=self.config.overshoot_m)

    def run(self, start: Pose2, trial: int, path: int) -> LearnedPath:
        """Learn along one path, to the goal, a wall or `config.max_options`."""
        regions, environment, length_m = self.arena.regions, self._environment, 0.0
        x_m, y_m, jitter_m = start.x_m, start.y_m, self.config.start_jitter_m
        if jitter_m:
            x_m += (2.0 * self.rng.random() - 1.0) * jitter_m
            y_m += (2.0 * self.rng.random() - 1.0) * jitter_m
            x_m, y_m = environment.clamp(x_m, y_m)
        before = Situation(regions.region_at(x_m, y_m), x_m, y_m, trial, path)
        if before.region in regions.ends:
            return regions.ends[before.region], 0, 0.0
        for count in range(1, self.config.max_options + 1):
            action = self.agent.choose(before)
            end = environment.advance(before.x_m, before.y_m, before.region, action)
            length_m += end.length_m
            outcome = PathOutcome.BUMP if end.bumped else regions.ends.get(end.region)
            after = before._replace(region=end.region, x_m=end.x_m, y_m=end.y_m)
            touched_rad = environment.touched_rad(end.x_m, end.y_m) if end.bumped else ()
            reward = regions.rewards.of(outcome)
            learned = Experience(before, action, reward, after, outcome, touched_rad)
            self.agent.learner.update(learned)
            if outcome is not None:
                return outcome, count, length_m
            before = after
        return PathOutcome.TIMEOUT, self.config.max_options, length_m
