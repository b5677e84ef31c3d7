"""The goal-reaching behaviour, one step per state: learned actions into velocities.

Crisp: "the vehicle rotates until it is oriented towards the selected direction and translates
until the current state changes" (section "The Action Set and Q-learning"). Fuzzy: every state
gives a heading of its own, which is followed on the move.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

import numpy as np

from goalreach_learning.actions import ACTION_HEADINGS_RAD, nearest_action
from goalreach_learning.blending import blend_heading, votes
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import QLearner
from goalreach_learning.steering import cruise_fraction, steering_rate
from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.values import (
    Confidence,
    PathOutcome,
    Pose2,
    Region,
    RegionState,
    Transition,
    Twist2,
)

__all__ = ['ControlStep', 'ControllerConfig', 'GoalReachingController', 'settled_region']

STANDING = Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)
_REWARDS = {PathOutcome.GOAL: 1.0, PathOutcome.BUMP: -1.0, PathOutcome.TIMEOUT: 0.0}
_NS_PER_S = 1e9


@dataclass(frozen=True, kw_only=True)
class ControlStep:
    """The answer to one state.

    Attributes:
        command: Velocities to drive with until the next state.
        heading_rad: Heading that is being followed, radians in `map`; None while standing idle.
        transition: The action that this state finished, or None. Where its outcome is not None
            the path has ended.
        policy_changed: Whether something was learned.
    """

    command: Twist2
    heading_rad: float | None = None
    transition: Transition | None = None
    policy_changed: bool = False


@dataclass(frozen=True, kw_only=True)
class _Action:
    """The action under way: where and how it was chosen."""

    region: Region
    index: int
    temperature: float


def settled_region(
    current: Region, state: RegionState, regions: RegionMap, margin_m: float
) -> Region:
    """Return the region after a state: the current one until the estimate is clearly out of it.

    An estimate jitters across a border that the robot has just crossed, or drives along; the
    margin keeps the region from flickering.

    Args:
        current: The region so far.
        state: The new state.
        regions: The region map.
        margin_m: How far outside the current region the estimate must be, metres.
    """
    if state.region == current:
        return current
    x_low, y_low, x_high, y_high = regions.bounds(current)
    outside_x = max(x_low - state.pose.x_m, state.pose.x_m - x_high)
    outside_y = max(y_low - state.pose.y_m, state.pose.y_m - y_high)
    return state.region if max(outside_x, outside_y) >= margin_m else current


class GoalReachingController:
    """Drives path after path; learns on the way if told to.

    With `config.learn` the actions are chosen by equation (2) and driven one by one as in
    `crisp` mode, whatever the mode, and every finished action is learned from by equation (1).

    Args:
        config: What can be tuned.
        policy: What is known at the start.
        rng: Source of the chance in equation (2).
    """

    def __init__(self, config: ControllerConfig, policy: Policy, rng: np.random.Generator) -> None:
        """Stand idle until a path begins."""
        self.config = config
        self._rng = rng
        self._policy = policy
        self._learner = QLearner(config.learning, policy.regions, policy)
        self._start: Pose2 | None = None
        self._path = self._trial = 0
        self._idle = True
        self._reset_path()
        self._last: tuple[int, ControlStep] | None = None

    def _reset_path(self) -> None:
        self._driving = False
        self._aligned = False
        self._began_ns: int | None = None
        self._action: _Action | None = None
        self._heading_rad: float | None = None

    @property
    def policy(self) -> Policy:
        """What is known now."""
        return self._policy

    def begin_path(self, *, start: Pose2 | None, path: int, trial: int) -> None:
        """Begin a path: wait for a good state near its start, then drive.

        Args:
            start: Where the robot was put; None to start from wherever it is.
            path: Number of the path within the run, from 0.
            trial: Number of the trial, from 0; it sets the temperature.
        """
        self._start, self._path, self._trial = start, path, trial
        self._idle = False
        self._reset_path()

    def step(self, *, time_ns: int, state: RegionState, bumped: bool) -> ControlStep:
        """Answer a state.

        Args:
            time_ns: Stamp of the state. The same stamp again gets the same command again, and
                nothing is learned twice.
            state: What is known of the robot's place.
            bumped: Whether a bumper is pressed.
        """
        if self._last is not None and self._last[0] == time_ns:
            return replace(self._last[1], transition=None, policy_changed=False)
        step = self._step(time_ns, state, bumped=bumped)
        self._last = (time_ns, step)
        return step

    def _step(self, time_ns: int, state: RegionState, *, bumped: bool) -> ControlStep:
        if self._idle:
            return ControlStep(command=STANDING)
        if self._began_ns is None:
            self._began_ns = time_ns
        sure = state.confidence is Confidence.OK
        if not self._driving and sure and self._near_start(state.pose):
            self._driving = True
        outcome = self._outcome(time_ns, state, bumped=bumped)
        if outcome is not None:
            return self._end(state, outcome)
        if not (self._driving and sure):
            return ControlStep(command=STANDING, heading_rad=self._heading_rad)
        return self._drive(state)

    def _near_start(self, pose: Pose2) -> bool:
        if self._start is None:
            return True
        distance_m = math.hypot(pose.x_m - self._start.x_m, pose.y_m - self._start.y_m)
        return distance_m <= self.config.start_tolerance_m

    def _outcome(self, time_ns: int, state: RegionState, *, bumped: bool) -> PathOutcome | None:
        if self._driving and bumped:
            return PathOutcome.BUMP
        sure = self._driving and state.confidence is Confidence.OK
        if sure and state.goal_probability >= self.config.goal_confidence:
            return PathOutcome.GOAL
        began_ns = time_ns if self._began_ns is None else self._began_ns
        if time_ns - began_ns >= self.config.timeout_s * _NS_PER_S:
            return PathOutcome.TIMEOUT
        return None

    def _end(self, state: RegionState, outcome: PathOutcome) -> ControlStep:
        """Finish the path; a time-out is cut off, not learned from."""
        self._idle = True
        next_region = self._policy.regions.goal if outcome is PathOutcome.GOAL else state.region
        if self._action is None:
            heading_rad = state.pose.heading_rad
            action = _Action(region=state.region, index=nearest_action(heading_rad), temperature=0)
            learn = False
        else:
            action, learn = self._action, outcome is not PathOutcome.TIMEOUT
        transition = self._transition(action, next_region, outcome)
        return ControlStep(
            command=STANDING,
            transition=transition,
            policy_changed=learn and self._learn(transition),
        )

    def _transition(
        self, action: _Action, next_region: Region, outcome: PathOutcome | None
    ) -> Transition:
        return Transition(
            state=action.region,
            action=action.index,
            reward=0.0 if outcome is None else _REWARDS[outcome],
            next_state=next_region,
            temperature=action.temperature,
            trial=self._trial,
            path=self._path,
            outcome=outcome,
        )

    def _learn(self, transition: Transition) -> bool:
        if not self.config.learn:
            return False
        self._learner.update(
            transition.state,
            transition.action,
            transition.reward,
            transition.next_state,
            terminal=transition.outcome is not None,
        )
        self._policy = self._learner.policy()
        return True

    def _drive(self, state: RegionState) -> ControlStep:
        transition, changed = self._finish_action(state)
        if self._action is None:
            self._action = self._choose(state)
        if self._one_by_one:
            self._head_for(self._action_heading(state))
        else:
            blended = blend_heading(self.config.mode, state.mu_x, state.mu_y, self._policy)
            self._heading_rad = self._heading_rad if blended is None else blended
        return ControlStep(
            command=self._command(state.pose),
            heading_rad=self._heading_rad,
            transition=transition,
            policy_changed=changed,
        )

    @property
    def _one_by_one(self) -> bool:
        """Whether actions are driven one by one, as the paper's options."""
        return self.config.learn or self.config.mode == 'crisp'

    def _finish_action(self, state: RegionState) -> tuple[Transition | None, bool]:
        """End the action when its region is left; one that entered the goal goes on until sure."""
        if self._action is None:
            return None, False
        regions = self._policy.regions
        region = settled_region(self._action.region, state, regions, self.config.region_margin_m)
        if region in (self._action.region, regions.goal):
            return None, False
        transition = self._transition(self._action, region, None)
        self._action = None
        return transition, self._learn(transition)

    def _choose(self, state: RegionState) -> _Action | None:
        if self.config.learn:
            temperature = self.config.learning.temperature(self._trial)
            index = self._learner.choose(state.region, temperature, self._rng.random())
            return _Action(region=state.region, index=index, temperature=temperature)
        action = self._policy.greedy_action(state.region)
        if action is None:
            action = self._neighbour_action(state)
        if action is None:
            return None
        return _Action(region=state.region, index=action, temperature=0.0)

    def _neighbour_action(self, state: RegionState) -> int | None:
        """Return the action of the weightiest cell that has one, or None where none votes."""
        found = votes('crisp', state.mu_x, state.mu_y, self._policy)
        return found[0].action if found else None

    def _action_heading(self, state: RegionState) -> float | None:
        """Return the heading of the action under way.

        Inside the goal but not yet sure of it, a greedy robot does as the neighbour it might
        still be in: one that came in along the goal's edge turns further in, not into the wall.
        """
        if self._action is None:
            return self._heading_rad
        index: int | None = self._action.index
        if not self.config.learn and state.region == self._policy.regions.goal:
            index = self._neighbour_action(state)
        return self._heading_rad if index is None else ACTION_HEADINGS_RAD[index]

    def _head_for(self, heading_rad: float | None) -> None:
        """Take a new heading; the robot stops and turns where it differs from the last."""
        if heading_rad != self._heading_rad:
            self._heading_rad = heading_rad
            self._aligned = False

    def _command(self, pose: Pose2) -> Twist2:
        if self._heading_rad is None:
            return STANDING
        config = self.config
        error_rad = angle_difference(self._heading_rad, pose.heading_rad)
        if abs(error_rad) <= config.align_tolerance_rad:
            self._aligned = True
        fraction = cruise_fraction(error_rad, config.stop_heading_error_rad)
        return Twist2(
            linear_m_per_s=config.cruise_speed_m_per_s * fraction if self._aligned else 0.0,
            steering_rad_per_s=steering_rate(
                error_rad,
                gain_per_s=config.heading_gain_per_s,
                limit_rad_per_s=config.steering_limit_rad_per_s,
                braking_rad_per_s2=config.steering_braking_rad_per_s2,
            ),
        )
