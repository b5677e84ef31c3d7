"""The learned behaviour: choice of actions, their end, their heading, and learning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from goalreach_learning.blending import blend_heading, votes
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import QLearner
from goalreach_learning.task import ACTION_HEADINGS_RAD
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import Region, RegionState, Transition


@dataclass(frozen=True, kw_only=True)
class Option:
    """An action being executed, which lasts until its region is left.

    Attributes:
        region: Region in which it was chosen.
        action: Index of the action.
        temperature: Boltzmann temperature of the choice; 0 for a greedy one.
    """

    region: Region
    action: int
    temperature: float


def settled_region(
    current: Region, state: RegionState, regions: RegionMap, margin_m: float
) -> Region:
    """Return the region after a state, with hysteresis at the borders.

    The region changes only when the estimate is outside of it by a margin, so that an estimate
    that jitters across a border does not change it repeatedly.

    Args:
        current: The present region.
        state: The new state.
        regions: The region map.
        margin_m: Distance from the present region at which it changes, metres.
    """
    if state.region == current:
        return current
    x_low, y_low, x_high, y_high = regions.bounds(current)
    outside_x = max(x_low - state.pose.x_m, state.pose.x_m - x_high)
    outside_y = max(y_low - state.pose.y_m, state.pose.y_m - y_high)
    return state.region if max(outside_x, outside_y) >= margin_m else current


class Behaviour:
    """Chooses actions by a policy, and learns from finished ones if configured to.

    Args:
        config: Parameters; may be replaced at any time.
        policy: Initial policy.
        rng: Generator of the choices by equation (2).

    Attributes:
        config: Present parameters.
        policy: Present policy.
    """

    def __init__(self, config: ControllerConfig, policy: Policy, rng: np.random.Generator) -> None:
        self.config = config
        self.policy = policy
        self._rng = rng
        self._learner = QLearner(config.learning, policy.regions, policy)

    @property
    def uses_options(self) -> bool:
        """Whether actions are executed one after the other, as the paper's options."""
        return self.config.learn or self.config.mode == 'crisp'

    def choose(self, state: RegionState, trial: int) -> Option | None:
        """Return the action to begin, or None where a greedy policy has none.

        Args:
            state: State of the robot.
            trial: Number of the trial, from 0, which determines the temperature of a learner.
        """
        if self.config.learn:
            temperature = self.config.learning.temperature(trial)
            action = self._learner.choose(state.region, temperature, self._rng.random())
            return Option(region=state.region, action=action, temperature=temperature)
        greedy = self.policy.greedy_action(state.region)
        if greedy is None:
            greedy = self._neighbour_action(state)
        if greedy is None:
            return None
        return Option(region=state.region, action=greedy, temperature=0.0)

    def _neighbour_action(self, state: RegionState) -> int | None:
        """Return the action of the cell with the largest weight that has one, or None."""
        found = votes('crisp', state.mu_x, state.mu_y, self.policy)
        return found[0].action if found else None

    def region_after(self, option: Option, state: RegionState) -> Region | None:
        """Return the region in which the option ended, or None while it continues.

        An option that has entered the goal continues until the goal is declared.
        """
        regions = self.policy.regions
        region = settled_region(option.region, state, regions, self.config.region_margin_m)
        return None if region in (option.region, regions.goal) else region

    def heading(self, option: Option | None, state: RegionState) -> float | None:
        """Return the heading to drive, radians in `map`, or None to keep the last one.

        Inside the goal before it is declared, a greedy robot takes the action of the neighbour
        in which it may still be: at the goal's edge it turns further in, not into the wall.

        Args:
            option: The action being executed.
            state: State of the robot.
        """
        if not self.uses_options:
            return blend_heading(self.config.mode, state.mu_x, state.mu_y, self.policy)
        if option is None:
            return None
        action: int | None = option.action
        if not self.config.learn and state.region == self.policy.regions.goal:
            action = self._neighbour_action(state)
        return None if action is None else ACTION_HEADINGS_RAD[action]

    def learn(self, transition: Transition) -> bool:
        """Learn from a finished action by equation (1) if configured to; return whether it did."""
        if not self.config.learn:
            return False
        self._learner.update(
            transition.state,
            transition.action,
            transition.reward,
            transition.next_state,
            terminal=transition.outcome is not None,
        )
        self.policy = self._learner.policy()
        return True
