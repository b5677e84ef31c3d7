"""The goal-reaching controller: one step per state, from learned actions to velocities.

Crisp: "the vehicle rotates until it is oriented towards the selected direction and translates
until the current state changes" (section "The Action Set and Q-learning"). Fuzzy: every state
has its own heading, which the robot follows while it drives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

import numpy as np

from goalreach_learning.behaviour import Behaviour, Option
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy
from goalreach_learning.steering import STANDING, HeadingFollower
from goalreach_learning.task import nearest_action, reward_of
from goalreach_msgs_py.values import (
    Confidence,
    PathOutcome,
    Pose2,
    Region,
    RegionState,
    Transition,
    Twist2,
)

_NS_PER_S = 1e9


@dataclass(frozen=True, kw_only=True)
class ControlStep:
    """The output for one state.

    Attributes:
        command: Velocities until the next state.
        heading_rad: Heading that is followed, radians in `map`; None while idle.
        transition: The action that ended with this state, or None. If its outcome is not None,
            the path has ended.
        policy_changed: Whether the policy was updated.
    """

    command: Twist2
    heading_rad: float | None = None
    transition: Transition | None = None
    policy_changed: bool = False


class GoalReachingController:
    """Drives path after path, and learns if configured to.

    With `config.learn` the actions are chosen by equation (2) and executed as in `crisp` mode,
    whatever the mode, and every finished action updates the policy by equation (1). The goal is
    declared when its probability reaches `config.goal_confidence`; while the state is uncertain
    or old the robot stops and waits.

    Args:
        config: Parameters.
        policy: Initial policy.
        rng: Generator of the choices by equation (2).
    """

    def __init__(self, config: ControllerConfig, policy: Policy, rng: np.random.Generator) -> None:
        self._behaviour = Behaviour(config, policy, rng)
        self._last: tuple[int, ControlStep] | None = None
        self.begin_path(start=None, path=0, trial=0)
        self._idle = True

    @property
    def policy(self) -> Policy:
        """Present policy."""
        return self._behaviour.policy

    @property
    def config(self) -> ControllerConfig:
        """Parameters; new ones take effect with the next step."""
        return self._behaviour.config

    @config.setter
    def config(self, config: ControllerConfig) -> None:
        self._behaviour.config = config

    def begin_path(self, *, start: Pose2 | None, path: int, trial: int) -> None:
        """Begin a path: wait for a confident state near its start, then drive.

        Args:
            start: Pose at which the robot was placed; None to start from its present pose.
            path: Number of the path within the run, from 0.
            trial: Number of the trial, from 0, which determines the temperature.
        """
        self._start, self._path, self._trial = start, path, trial
        self._idle = self._driving = False
        self._began_ns: int | None = None
        self._option: Option | None = None
        self._follower = HeadingFollower()

    def step(self, *, time_ns: int, state: RegionState, bumped: bool) -> ControlStep:
        """Return the output for a state.

        Args:
            time_ns: Stamp of the state. A repeated stamp yields the same command and no update.
            state: Estimated state of the robot.
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
        outcome = self._outcome(time_ns - self._began_ns, state, bumped=bumped)
        if outcome is not None:
            return self._end(state, outcome)
        if not (self._driving and sure):
            return ControlStep(command=STANDING, heading_rad=self._follower.heading_rad)
        return self._drive(state)

    def _near_start(self, pose: Pose2) -> bool:
        if self._start is None:
            return True
        distance_m = math.hypot(pose.x_m - self._start.x_m, pose.y_m - self._start.y_m)
        return distance_m <= self.config.start_tolerance_m

    def _outcome(self, elapsed_ns: int, state: RegionState, *, bumped: bool) -> PathOutcome | None:
        if self._driving and bumped:
            return PathOutcome.BUMP
        sure = self._driving and state.confidence is Confidence.OK
        if sure and state.goal_probability >= self.config.goal_confidence:
            return PathOutcome.GOAL
        if elapsed_ns >= self.config.timeout_s * _NS_PER_S:
            return PathOutcome.TIMEOUT
        return None

    def _end(self, state: RegionState, outcome: PathOutcome) -> ControlStep:
        """Finish the path; an action truncated by the time-out updates nothing."""
        self._idle = True
        goal = self.policy.regions.goal
        option, learns = self._option, outcome is not PathOutcome.TIMEOUT
        if option is None:  # the path ended before an action was chosen
            action = nearest_action(state.pose.heading_rad)
            option, learns = Option(region=state.region, action=action, temperature=0.0), False
        next_region = goal if outcome is PathOutcome.GOAL else state.region
        transition = self._transition(option, next_region, outcome)
        return ControlStep(
            command=STANDING,
            transition=transition,
            policy_changed=learns and self._behaviour.learn(transition),
        )

    def _transition(
        self, option: Option, next_region: Region, outcome: PathOutcome | None
    ) -> Transition:
        return Transition(
            state=option.region,
            action=option.action,
            reward=reward_of(outcome),
            next_state=next_region,
            temperature=option.temperature,
            trial=self._trial,
            path=self._path,
            outcome=outcome,
        )

    def _drive(self, state: RegionState) -> ControlStep:
        transition, changed = self._finish_option(state), False
        if transition is not None:
            changed = self._behaviour.learn(transition)
        if self._option is None:
            self._option = self._behaviour.choose(state, self._trial)
        heading_rad = self._behaviour.heading(self._option, state)
        if heading_rad is not None and self._behaviour.uses_options:
            self._follower.turn_to(heading_rad)
        elif heading_rad is not None:
            self._follower.steer_to(heading_rad)
        return ControlStep(
            command=self._follower.command(state.pose, self.config),
            heading_rad=self._follower.heading_rad,
            transition=transition,
            policy_changed=changed,
        )

    def _finish_option(self, state: RegionState) -> Transition | None:
        if self._option is None:
            return None
        region = self._behaviour.region_after(self._option, state)
        if region is None:
            return None
        transition = self._transition(self._option, region, None)
        self._option = None
        return transition
