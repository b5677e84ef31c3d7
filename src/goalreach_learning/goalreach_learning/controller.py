"""The goal-reaching controller: one step per state, from learned actions to velocities.

Crisp: "the vehicle rotates until it is oriented towards the selected direction and translates
until the current state changes" (section "The Action Set and Q-learning"). Fuzzy: every state
has its own heading, which the robot follows while it drives.
"""

from dataclasses import replace
import math
from typing import NamedTuple

import numpy as np

from goalreach_learning.actor import Actor, Option, situation
from goalreach_learning.behaviors import GOAL, BehaviorStack, Opinion, Surroundings
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy import Policy, nearest_action
from goalreach_learning.steering import STANDING, HeadingFollower
from goalreach_msgs_py.values import (
    Confidence,
    PathOutcome,
    Pose2,
    RegionState,
    Transition,
    Twist2,
)

NOTHING = Surroundings()
"""A robot without bumpers and sonar."""
_UNSURE_NS = 1_000_000_000
"""Time of uncertainty after which a robot looks around. Chosen."""


class ControlStep(NamedTuple):
    """The output for one state.

    Attributes:
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

    With `config.learn` the actions are chosen by equation (2), with the generator, and executed as
    in `crisp` mode, whatever the mode, and every finished action updates the policy by equation
    (1). The goal is declared when its probability reaches `config.goal_confidence`; while the
    state is uncertain or old the robot stops and waits. If it cannot turn its camera, it turns
    itself, unless the state is old.

    Attributes:
        actor: Holds the parameters; new ones take effect with the next step.
    """

    def __init__(self, config: ControllerConfig, policy: Policy, rng: np.random.Generator) -> None:
        self.actor = Actor(config, policy, rng)
        others = config.behaviors != GOAL
        self._others = BehaviorStack(config, policy.regions) if others else None
        self._last: tuple[int, ControlStep] | None = None
        self._sure_ns: int | None = None
        self.begin_path(start=None, path=0, trial=0)
        self._idle = True

    @property
    def policy(self) -> Policy:
        """Present policy."""
        return self.actor.policy

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
        if self._others is not None and start is not None:  # nothing is known around that place
            self._others = BehaviorStack(self.actor.config, self.policy.regions)

    def aim(self, policy: Policy) -> None:
        """Drive by another policy from now on, towards its goal."""
        self.actor.policy = policy
        self._option = None
        if self._others is not None:
            self._others.regions = policy.regions

    @property
    def opinions(self) -> tuple[Opinion, ...]:
        """What each behaviour proposed last; nothing where goal-reaching is alone."""
        return self._others.opinions if self._others else ()

    def step(
        self,
        *,
        time_ns: int,
        state: RegionState,
        bumped: bool,
        around: Surroundings = NOTHING,
        head_turns: bool = True,
    ) -> ControlStep:
        """Return the output for a state.

        Args:
            time_ns: Stamp of the state. A repeated stamp yields the same command and no update.
            state: Estimated state of the robot.
            bumped: Whether a bumper is pressed.
            around: What is felt and heard, for learners and behaviours that make use of it.
            head_turns: Whether the camera can look for landmarks by itself.
        """
        self._around = around
        if self._last is not None and self._last[0] == time_ns:
            return self._last[1]._replace(transition=None, policy_changed=False)
        if self._sure_ns is None or state.confidence is Confidence.OK:
            self._sure_ns = time_ns
        step = self._step(time_ns, state, bumped=bumped)
        waits = not self._idle and step.command == STANDING
        unsure = waits and state.confidence is Confidence.UNCERTAIN
        if unsure and not head_turns and time_ns - self._sure_ns >= _UNSURE_NS:
            turn = replace(STANDING, steering_rad_per_s=self.actor.config.look_around_rad_per_s)
            step = step._replace(command=turn)
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
        if self._others is not None and state.confidence is not Confidence.STALE:
            self._others.sense(time_ns, state, self._around, standing=not self._driving)
            if self._driving and not sure:
                return ControlStep(command=self._others.drive(self._follower, STANDING))
        if not (self._driving and sure):
            return ControlStep(command=STANDING, heading_rad=self._follower.heading_rad)
        return self._drive(state)

    def _near_start(self, pose: Pose2) -> bool:
        if self._start is None:
            return True
        distance_m = math.hypot(pose.x_m - self._start.x_m, pose.y_m - self._start.y_m)
        return distance_m <= self.actor.config.start_tolerance_m

    def _outcome(self, elapsed_ns: int, state: RegionState, *, bumped: bool) -> PathOutcome | None:
        if self._driving and bumped and 'escape' not in self.actor.config.behaviors:
            return PathOutcome.BUMP
        sure = self._driving and state.confidence is Confidence.OK
        if sure and state.goal_probability >= self.actor.config.goal_confidence:
            return PathOutcome.GOAL
        if sure and state.region in self.policy.regions.forbidden:
            return PathOutcome.FORBIDDEN
        if elapsed_ns >= self.actor.config.timeout_s * 1e9:
            return PathOutcome.TIMEOUT
        return None

    def _end(self, state: RegionState, outcome: PathOutcome) -> ControlStep:
        """Finish the path; an action truncated by the time-out updates nothing."""
        self._idle = True
        option, learns = self._option, outcome is not PathOutcome.TIMEOUT
        if option is None:  # the path ended before an action was chosen
            action = nearest_action(state.pose.heading_rad, self.policy.regions.actions)
            begin = situation(state, state.region, self._trial, self._path)
            option, learns = Option(begin, action), False
        touched_rad: tuple[float, ...] = ()
        if outcome is PathOutcome.BUMP and self._start is not None:
            # It was placed with its base along its heading, and steering does not turn the base.
            touched_rad = self._around.touched_rad(self._start.heading_rad)
        region = self.policy.regions.goal if outcome is PathOutcome.GOAL else state.region
        transition, changed = self.actor.finish(
            option, state, region, outcome=outcome, touched_rad=touched_rad, learns=learns
        )
        return ControlStep(command=STANDING, transition=transition, policy_changed=changed)

    def _drive(self, state: RegionState) -> ControlStep:
        actor, follower = self.actor, self._follower
        transition, changed = None, False
        region = actor.region_after(self._option, state) if self._option else None
        if self._option is not None and region is not None:
            transition, changed = actor.finish(self._option, state, region)
            self._option = None
        if self._option is None:
            self._option = actor.choose(state, self._trial, self._path)
        heading_rad = actor.heading(self._option, state)
        if heading_rad is not None:
            (follower.turn_to if actor.uses_options else follower.steer_to)(heading_rad)
        command = follower.command(state.pose, self.actor.config)
        if self._others is not None:
            command = self._others.drive(follower, command)
        return ControlStep(
            command=command,
            heading_rad=follower.heading_rad,
            transition=transition,
            policy_changed=changed,
        )
