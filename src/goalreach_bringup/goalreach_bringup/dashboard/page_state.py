"""All that the page knows, filled from messages and read by the views."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import math
from typing import Any, Final

import numpy as np

from goalreach_bringup.dashboard.health import Health
from goalreach_bringup.dashboard.learning_book import LearningBook
from goalreach_bringup.dashboard.motion import RobotPicture
from goalreach_bringup.run.plan import CONTROLLER, ESTIMATOR, LOCALIZER, NODES, ROBOT
from goalreach_learning.policy import Policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.topics import CLOCK, CMD_VEL, GROUND_TRUTH, POSE, STATE
from goalreach_msgs_py.values import (
    Confidence,
    FloatArray,
    LandmarkObservation,
    PoseEstimate,
    RegionState,
    Transition,
)
from goalreach_perception.state_estimator import StateEstimatorConfig

__all__ = ['TOPICS_OF', 'CameraPicture', 'PageState']

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
