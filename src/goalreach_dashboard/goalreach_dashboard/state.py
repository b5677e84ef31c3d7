"""All that the page knows, filled from messages and read by the views."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
import math
from typing import Any, Final

import numpy as np

from goalreach_dashboard.health import Health
from goalreach_dashboard.trails import RobotPicture
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.topics import (
    CLOCK,
    CMD_VEL,
    CONTROLLER,
    ESTIMATOR,
    GROUND_TRUTH,
    LOCALIZER,
    NODES,
    POSE,
    ROBOT,
    STATE,
)
from goalreach_msgs_py.values import (
    Confidence,
    FloatArray,
    LandmarkObservation,
    PathOutcome,
    PoseEstimate,
    RegionState,
    Transition,
)
from goalreach_perception.state_estimator import StateEstimatorConfig

WINDOW: Final = 22
"""Paths of a trial, section "The Simulation Phase": success is told of so many."""
_POINTS: Final = 600


class LearningBook:
    """Counts finished paths and keeps the curve of success over the last 22 of them.

    Attributes:
        paths: Paths that ended since the page began to listen.
        goals: Those declared at the goal, truly in it where the truth is known.
        false_goals: Those declared at the goal with the robot outside.
        bumps: Those that ended at a wall.
        timeouts: Those that took too long.
        last: The last finished action, or None.
        curve: Number of a path, from 1, and the share of goals among the 22 paths up to it;
            at most 600 points, of which every other one is left out when they are too many.
    """

    def __init__(self) -> None:
        """Start an empty book."""
        self.paths = self.goals = self.false_goals = self.bumps = self.timeouts = 0
        self.last: Transition | None = None
        self.curve: list[tuple[int, float]] = []
        self._recent: deque[bool] = deque(maxlen=WINDOW)

    def add(self, transition: Transition, *, in_goal: bool | None) -> None:
        """Take a finished action.

        Args:
            transition: The action.
            in_goal: Whether the true position was in the goal region, None where it is not known.
        """
        self.last = transition
        if transition.outcome is None:
            return
        goal = transition.outcome is PathOutcome.GOAL and in_goal is not False
        self.paths += 1
        self.goals += goal
        self.false_goals += transition.outcome is PathOutcome.GOAL and not goal
        self.bumps += transition.outcome is PathOutcome.BUMP
        self.timeouts += transition.outcome is PathOutcome.TIMEOUT
        self._recent.append(goal)
        number = transition.path + 1
        while self.curve and self.curve[-1][0] >= number:
            self.curve.pop()  # a path that is driven again, after a node was started again
        self.curve.append((number, sum(self._recent) / len(self._recent)))
        if len(self.curve) > _POINTS:
            self.curve = self.curve[::2]


_DEFAULT_FOV_RAD: Final = math.radians(60.0)
_SLACK_NS: Final = 200_000_000
_SURE_M: Final = StateEstimatorConfig().max_position_sigma_m
TOPICS_OF: Final = {
    ROBOT: (CLOCK, GROUND_TRUTH),
    LOCALIZER: (POSE,),
    ESTIMATOR: (STATE,),
    CONTROLLER: (CMD_VEL,),
}


@dataclass(frozen=True, kw_only=True)
class CameraPicture:
    """An image and what was detected in it.

    Attributes:
        url: The encoded image as a `data:` URL.
        width_px: Its width.
        height_px: Its height.
        landmarks: LEDs by number, None where not seen.
        stamp_ns: Stamp of the image.
    """

    url: str
    width_px: int
    height_px: int
    landmarks: tuple[LandmarkObservation | None, ...]
    stamp_ns: int


@dataclass(kw_only=True)
class PageState:
    """The view model's ground: values only, no ROS, no browser.

    Attributes:
        arena: The arena driven in.
        robot: Poses and trails.
        book: What came of the paths.
        health: Nodes and topics.
        state: The last region state, or None.
        policy: What is learned, or None.
        picture: The last image, or None.
        landmarks: The last detections.
        fov_rad: Horizontal field of view.
        clock_ns: The robot's time.
        parameters: By node, the parameters that it told.
        paused_ns: The robot's time when this page paused the simulation, or None.
    """

    arena: Arena
    robot: RobotPicture = field(init=False)
    book: LearningBook = field(default_factory=LearningBook)
    health: Health = field(default_factory=lambda: Health(TOPICS_OF))
    state: RegionState | None = None
    policy: Policy | None = None
    picture: CameraPicture | None = None
    landmarks: tuple[LandmarkObservation | None, ...] = ()
    fov_rad: float = _DEFAULT_FOV_RAD
    clock_ns: int = 0
    parameters: dict[str, Mapping[str, Any]] = field(
        default_factory=lambda: {name: {} for name in NODES}
    )
    paused_ns: int | None = None

    def __post_init__(self) -> None:
        """Begin with an empty picture."""
        self.robot = RobotPicture(self.arena.length_m)

    def restart(self) -> None:
        """Forget poses and rates, which have gaps after a time without viewers."""
        self.robot = RobotPicture(self.arena.length_m)
        self.health = Health(TOPICS_OF)

    def add_estimate(self, stamp_ns: int, estimate: PoseEstimate) -> None:
        """Take an estimate; it leaves a trail while it and the state are trusted.

        A localizer that looks for its place says so in its covariance at once, in the state only
        a moment later.
        """
        narrow = float(max(estimate.covariance[0, 0], estimate.covariance[1, 1])) < _SURE_M**2
        sure = narrow and self.state is not None and self.state.confidence is Confidence.OK
        self.robot.add_estimate(stamp_ns, estimate, sure=sure)

    def add_transition(self, stamp_ns: int, transition: Transition) -> None:
        """Take a finished action, judged by the truth of its stamp."""
        truth = self.robot.truth_at(stamp_ns)
        in_goal = None
        if truth is not None:
            regions = self.arena.regions
            in_goal = regions.region_at(truth.x_m, truth.y_m) == regions.goal
        self.book.add(transition, in_goal=in_goal)

    def set_q_table(self, q: FloatArray) -> None:
        """Take the Q-values; an action that is not exactly zero has been tried."""
        if self.policy is None or not np.array_equal(self.policy.q, q):
            tried = (q != 0).astype(np.int64)
            self.policy = Policy(q=q, visits=tried, regions=self.arena.regions)

    @property
    def mode(self) -> str:
        """How the robot is driven, as far as it is known."""
        return str(self.parameters[CONTROLLER].get('mode', 'fuzzy'))

    @property
    def learning(self) -> bool:
        """Whether the robot learns."""
        return bool(self.parameters[CONTROLLER].get('learn', False))

    @property
    def stands_still(self) -> bool:
        """Whether this page paused the simulation and nobody let it go on since."""
        return self.paused_ns is not None and self.clock_ns <= self.paused_ns + _SLACK_NS

    def set_arena(self, arena: Arena) -> None:
        """Take another arena, as the robot told it."""
        if arena == self.arena:
            return
        self.arena = arena
        self.robot = RobotPicture(arena.length_m)
        if self.policy is not None:
            policy, self.policy = self.policy, None
            self.set_q_table(np.array(policy.q))
