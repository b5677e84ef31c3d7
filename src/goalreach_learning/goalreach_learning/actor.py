"""The actor: chooses actions by a policy, says when they end and where they head, and learns."""

from typing import NamedTuple

import numpy as np

from goalreach_learning.blending import blend_heading, votes
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.learner import Agent, Experience, Situation
from goalreach_learning.policy import Policy, action_headings_rad
from goalreach_msgs_py.values import Confidence, PathOutcome, Region, RegionState, Transition


class Option(NamedTuple):
    """An action being executed, which lasts until its region is left.

    It began in a situation, chosen at a Boltzmann temperature; 0 for a greedy one.
    """

    begin: Situation
    action: int
    temperature: float = 0.0


class Actor:
    """Chooses actions by its policy, and learns from finished ones if configured to."""

    def __init__(self, config: ControllerConfig, policy: Policy, rng: np.random.Generator) -> None:
        self.config, self.policy = config, policy
        self._agent: Agent | None = None
        if config.learn:
            self._agent = Agent(config.learner, policy.regions, config.learning, rng, policy)

    @property
    def uses_options(self) -> bool:
        """Whether actions are executed one after the other, as the paper's options."""
        return self.config.learn or self.config.mode == 'crisp'

    def choose(self, state: RegionState, trial: int, path: int = 0) -> Option | None:
        """Return the action to begin, or None where a greedy policy has none."""
        begin = situation(state, state.region, trial, path)
        if self._agent is not None:
            temperature = self.config.learning.temperature(trial)
            return Option(begin, self._agent.choose(begin), temperature)
        action = self.policy.greedy_action(state.region)
        action = self._neighbour_action(state) if action is None else action
        return None if action is None else Option(begin, action)

    def _neighbour_action(self, state: RegionState) -> int | None:
        """Return the action of the cell with the largest weight that has one, or None."""
        found = votes('crisp', state.mu_x, state.mu_y, self.policy)
        return found[0].action if found else None

    def region_after(self, option: Option, state: RegionState) -> Region | None:
        """Return the region in which the option ended, or None while it continues.

        The estimate must be outside of its region by a margin, so that one that jitters across a
        border ends no further option. In the goal it continues until the goal is declared.
        """
        regions, begun = self.policy.regions, option.begin.region
        if state.region in (begun, regions.goal):
            return None
        x_low, y_low, x_high, y_high = regions.bounds(begun)
        outside_x = max(x_low - state.pose.x_m, state.pose.x_m - x_high)
        outside_y = max(y_low - state.pose.y_m, state.pose.y_m - y_high)
        outside_m = max(outside_x, outside_y)
        return state.region if outside_m >= self.config.region_margin_m else None

    def heading(self, option: Option | None, state: RegionState) -> float | None:
        """Return the heading to drive, radians in `map`, or None to keep the last one.

        Inside the goal before it is declared, a greedy robot takes the action of the neighbour
        in which it may still be: at the goal's edge it turns further in, not into the wall.
        """
        if not self.uses_options:
            return blend_heading(self.config.mode, state.mu_x, state.mu_y, self.policy)
        action = option.action if option else None
        if option and not self.config.learn and state.region == self.policy.regions.goal:
            action = self._neighbour_action(state)
        return None if action is None else action_headings_rad(self.policy.regions.actions)[action]

    def finish(
        self,
        option: Option,
        state: RegionState,
        region: Region,
        *,
        outcome: PathOutcome | None = None,
        touched_rad: tuple[float, ...] = (),
        learns: bool = True,
    ) -> tuple[Transition, bool]:
        """Return the transition of a finished action, and whether the policy was updated by it.

        The state is that at its end. `outcome` tells how the path ended with it, if it did;
        `touched_rad` are the azimuths of what the bumpers touch in `map`. It may be learned from
        where `learns` is set, if configured to.
        """
        before, reward = option.begin, self.policy.regions.rewards.of(outcome)
        if self._agent is not None and learns:
            after = situation(state, region, before.trial, before.path)
            self._agent.learner.update(
                Experience(before, option.action, reward, after, outcome, touched_rad)
            )
            self.policy = self._agent.policy
        transition = Transition(
            state=before.region,
            action=option.action,
            reward=reward,
            next_state=region,
            temperature=option.temperature,
            trial=before.trial,
            path=before.path,
            outcome=outcome,
        )
        return transition, learns and self._agent is not None


def situation(state: RegionState, region: Region, trial: int, path: int) -> Situation:
    """Return what a learner sees of a state that counts as one of a region."""
    return Situation(
        region=region,
        x_m=state.pose.x_m,
        y_m=state.pose.y_m,
        trial=trial,
        path=path,
        certain=state.confidence is Confidence.OK,
    )
