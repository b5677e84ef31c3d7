"""State of the live page: filled from messages, read by the views; no ROS, no browser."""

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import math
from typing import Any, Final

import numpy as np

from goalreach_dashboard.health import GraphHealth
from goalreach_dashboard.pose_history import PoseHistory
from goalreach_learning.policy import Policy
from goalreach_msgs_py import topics, values
from goalreach_msgs_py.arena import PAPER_STARTS, Arena
from goalreach_msgs_py.diagnostic_messages import Status
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, LOCALIZER, NODES, ROBOT
from goalreach_perception.state_estimator import StateEstimatorConfig

_MAX_CURVE_POINTS: Final = 600
_DEFAULT_FOV_RAD: Final = math.radians(60.0)
_PAUSE_TOLERANCE_NS: Final = 1_000_000_000
"""Ticks that were on their way when the simulation was paused are no more than this. Chosen: four
times real time, a quarter of a second late."""
_MAX_EVENTS: Final = 1000
"""Of a run without end the page lists the last paths. Chosen."""
_TRUSTED_SIGMA_M: Final = StateEstimatorConfig().max_position_sigma_m
TOPICS_OF: Final = {
    ROBOT: (topics.CLOCK, topics.GROUND_TRUTH, topics.ODOM),
    LOCALIZER: (topics.POSE,),
    ESTIMATOR: (topics.STATE,),
    CONTROLLER: (topics.CMD_VEL,),
}
"""By node, topics that it publishes at every tick."""

Landmarks = tuple[values.LandmarkObservation | None, ...]


class PathStatistics:
    """Counts finished paths and the share of goals among the last 22, as many as a trial has.

    Attributes:
        outcomes: Finished paths by outcome since the page started, or since the run began.
        last: The last finished action, or None.
        curve: Number of a path, from 1, and the share of goals among the 22 paths up to it;
            beyond 600 points every other one is dropped.
    """

    def __init__(self) -> None:
        self.outcomes: Counter[str] = Counter()
        self.last: values.Transition | None = None
        self.curve: list[tuple[int, float]] = []
        self._recent: deque[bool] = deque(maxlen=PAPER_STARTS)

    def add(self, number: int, outcome: str) -> None:
        """Count a finished path, by its number from 1."""
        self.outcomes[outcome] += 1
        self._recent.append(outcome == values.PathOutcome.GOAL.value)
        while self.curve and self.curve[-1][0] >= number:
            self.curve.pop()  # a restarted controller repeats a path
        self.curve.append((number, sum(self._recent) / len(self._recent)))
        if len(self.curve) > _MAX_CURVE_POINTS:
            self.curve = self.curve[::2]


@dataclass(frozen=True, kw_only=True)
class CameraPicture:
    """An encoded image as a `data:` URL, and the landmarks detected in it.

    LEDs are by number, None where not seen; there are none where unknown.
    """

    url: str
    width_px: int
    height_px: int
    landmarks: Landmarks


@dataclass(kw_only=True)
class PageState:
    """All that the page shows; what has not come yet is None or empty.

    Attributes:
        learner: Name and state of the learner, if it keeps more than a table.
        behaviors: What behaviours proposed last, none where goal-reaching is alone.
        obstacles: Obstacles: x, y, length, width (m), heading (rad), whether round.
        clock_ns: Time of the graph's clock.
        parameters: Polled parameters by node.
        paused_ns: Time of the clock when this page paused the simulation, or None.
        ended: Whether the run that started the page has ended.
        bag: Folder of the bag recorded last, empty where there is none.
        external: Nodes that the run did not start.
        events: What happened in the run, by ascending number, at most 1000: the first describes
            the run, then the last finished paths, recordings, and the end.
    """

    arena: Arena
    poses: PoseHistory = field(init=False)
    paths: PathStatistics = field(default_factory=PathStatistics)
    health: GraphHealth = field(default_factory=lambda: GraphHealth(TOPICS_OF))
    state: values.RegionState | None = None
    policy: Policy | None = None
    learner: Mapping[str, Any] = field(default_factory=dict)
    picture: CameraPicture | None = None
    landmarks: Landmarks = ()
    head: values.HeadAngles | None = None
    bumpers: tuple[bool, ...] = ()
    behaviors: Sequence[Status] = ()
    obstacles: Sequence[tuple[float, ...]] = ()
    fov_rad: float = _DEFAULT_FOV_RAD
    clock_ns: int = 0
    parameters: dict[str, Mapping[str, Any]] = field(
        default_factory=lambda: {name: {} for name in NODES}
    )
    paused_ns: int | None = None
    ended: bool = False
    bag: str = ''
    external: tuple[str, ...] = ()
    events: dict[int, Mapping[str, Any]] = field(default_factory=dict)
    _q: values.FloatArray | None = None
    _is_reported: bool = False

    def __post_init__(self) -> None:
        self.poses = PoseHistory(self.arena.length_m)

    def add_event(self, event: Mapping[str, Any]) -> None:
        """Add what the launcher reports; the beginning of a run discards the one before."""
        number = max(self.events, default=0) + 1
        if event['event'] == 'begin':
            vars(self).update(vars(PageState(arena=self.arena)))
            self._is_reported = True
        if event['event'] == 'path':
            event = {'number': self.paths.outcomes.total() + 1, **event}
            self.paths.add(event['number'], event['outcome'])
        self.ended = self.ended or event['event'] == 'end'
        self.bag = event.get('bag', self.bag)
        self.external = tuple(event.get('external', self.external))
        self.events[number] = event
        if len(self.events) > _MAX_EVENTS:
            kinds = {n: e['event'] for n, e in self.events.items() if e['event'] != 'begin'}
            del self.events[min(kinds, key=lambda n: (kinds[n] != 'path', n))]

    def restart(self) -> None:
        """Discard poses and rates, which have a gap after a time without viewers."""
        self.poses = PoseHistory(self.arena.length_m)
        self.health = GraphHealth(TOPICS_OF)

    def add_estimate(self, stamp_ns: int, estimate: values.PoseEstimate) -> None:
        """Add an estimate; it leaves a trail while it and the region state are trusted.

        A localizer that searches for its pose widens its covariance at once; the region state
        follows a moment later.
        """
        variance = float(max(estimate.covariance[0, 0], estimate.covariance[1, 1]))
        certain = self.state is not None and self.state.confidence is values.Confidence.OK
        trusted = certain and variance < _TRUSTED_SIGMA_M**2
        self.poses.add_estimate(stamp_ns, estimate, trusted=trusted)

    def add_transition(self, stamp_ns: int, transition: values.Transition) -> None:
        """Add a finished action; the end of a path is judged by the true pose of its stamp.

        Where the truth is unknown, a declared goal counts. In a run the launcher judges.
        """
        self.paths.last = transition
        if transition.outcome is None or self._is_reported:
            return
        outcome, truth = transition.outcome.value, self.poses.truths.get(stamp_ns)
        if transition.outcome is values.PathOutcome.GOAL and truth is not None:
            regions = self.arena.regions
            is_goal = regions.region_at(truth.x_m, truth.y_m) == regions.goal
            outcome = outcome if is_goal else 'false-goal'
        path = {'number': transition.path + 1, 'outcome': outcome, 'end_s': stamp_ns * 1e-9}
        self.add_event({'event': 'path', **path})

    def place(self, pose: values.Pose2) -> None:
        """Show the robot where it was placed: while paused it publishes no pose."""
        self.poses = PoseHistory(self.arena.length_m)
        self.poses.truth = pose

    def set_q_table(self, q: values.FloatArray) -> None:
        """Set the Q-values, which wait for an arena that they fit."""
        if self._q is None or not np.array_equal(self._q, q):
            self._q, self.policy = q, Policy.of_table(q, self.arena.regions)

    @property
    def mode(self) -> str:
        """The controller's mode; `fuzzy`, the default, until it is known."""
        return str(self.parameters[CONTROLLER].get('mode', 'fuzzy'))

    @property
    def learning(self) -> bool:
        """Whether the controller learns."""
        return bool(self.parameters[CONTROLLER].get('learn', False))

    @property
    def is_paused(self) -> bool:
        """Whether this page paused the simulation and nobody has resumed it."""
        limit_ns = self.paused_ns
        return limit_ns is not None and self.clock_ns <= limit_ns + _PAUSE_TOLERANCE_NS

    def set_arena(self, arena: Arena) -> None:
        """Set the arena that the robot's parameters describe."""
        if arena == self.arena:
            return
        self.arena = arena
        self.poses = PoseHistory(arena.length_m)
        if self._q is not None:
            self.policy = Policy.of_table(self._q, arena.regions)
