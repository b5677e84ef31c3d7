"""The launcher's own node: evaluates the paths that the graph drives."""

from collections.abc import Callable, Sequence
from functools import partial
import math
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
import numpy as np
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger

from goalreach_bringup.launch.graph import remap_arguments
from goalreach_bringup.launch.path_evaluator import PathEvaluator, Progress
from goalreach_bringup.launch.plan import RESTARTED_NS
from goalreach_evaluation.path_metrics import PathResult, Tick
from goalreach_learning.blending import blend_heading
from goalreach_learning.policy import Policy
from goalreach_msgs_py import topics
from goalreach_msgs_py.alignment import InputAligner, interpolate_odometry
from goalreach_msgs_py.cdr import MessageError
from goalreach_msgs_py.diagnostic_messages import (
    q_table_from_raw,
    state_from_raw,
    transition_from_raw,
)
from goalreach_msgs_py.pose_messages import odometry_from_raw
from goalreach_msgs_py.ros.acknowledgement import Acknowledger
from goalreach_msgs_py.ros.messaging import DEEP_QOS, LATCHED_QOS, steady_timer, subscribe_raw
from goalreach_msgs_py.values import Confidence, PathOutcome, Pose2

_SILENCE_S = 1.0
"""An outcome whose tick is missing after this long without messages is judged without. Chosen."""
_WINDOW_TICKS = 100
"""Half of what the queues hold, so that none is lost; hardly ever full, since evaluating a tick
costs less than making it. Chosen."""
_ACKNOWLEDGED_TICKS = 10
"""Number of ticks per acknowledgement; chosen."""


class RunMonitor(Node):
    """Follows truth, state and transitions and passes finished paths to the launcher.

    A path that could not be judged is passed as None.

    Publishes: acknowledgements of ticks (see `Acknowledger`).
    Serves, where it has no starts: `~/start`, which begins the path that waits for a person.
    Subscribes: `/ground_truth/odom`, `/state`, `/q_learning/q_table`, and, once it has received
    a whole tick, `/q_learning/transition`: the controller waits for that subscription before its
    first path, so that no path is missed. Without a truth a tick is a state that is certain.

    Attributes:
        began_ns: The first stamp of the robot's clock; None before.
    """

    def __init__(
        self,
        evaluator: PathEvaluator,
        policy: Policy,
        mode: str,
        on_path: Callable[[PathResult | None], None],
        remaps: Sequence[str] = (),
    ) -> None:
        super().__init__(topics.MONITOR, cli_args=remap_arguments(remaps))
        self._policy = policy
        self._mode = mode
        self._on_path = on_path
        self._evaluator = evaluator
        self._last_truth: tuple[int, Pose2] | None = None
        self._received_s = time.monotonic()
        self.began_ns: int | None = None
        self._newest_ns: dict[str, int] = {}
        self._followers = {topics.GROUND_TRUTH: interpolate_odometry} if evaluator.judged else {}
        self._inputs = self._aligner()
        state, truth = topics.STATE, topics.GROUND_TRUTH
        subscribe_raw(self, DiagnosticArray, state, partial(self._collect, state), DEEP_QOS)
        if evaluator.judged:
            subscribe_raw(self, Odometry, truth, partial(self._collect, truth), DEEP_QOS)
        subscribe_raw(self, Float64MultiArray, topics.Q_TABLE, self._on_q_table, LATCHED_QOS)
        self._acknowledger = Acknowledger(self, window_ticks=_WINDOW_TICKS)
        self._ticks = 0
        if not evaluator.starts:
            self._start = self.create_client(Trigger, f'{topics.CONTROLLER}/start')
            self.create_service(Trigger, '~/start', self._on_start)
        steady_timer(self, _SILENCE_S, self._evaluate_pending)

    @property
    def progress(self) -> Progress:
        """Progress of the run."""
        path, placed = self._evaluator.path, self._evaluator.has_begun
        last_ns, truth = self._last_truth or self._evaluator.last
        return Progress(path=path, placed=placed, last_ns=last_ns, truth=truth)

    def start_path(self) -> None:
        """Begin the path that waits until somebody has placed the robot."""
        self._start.call_async(Trigger.Request()).add_done_callback(self._on_started)

    def _on_started(self, call: Any) -> None:
        if call.result().success:
            self._evaluator.begin_path()

    def _on_start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self._start.service_is_ready()
        if response.success:
            self.start_path()
        return response

    def _aligner(self) -> InputAligner:
        return InputAligner(topics.STATE, self._followers, wait_s=math.inf, depth=200)

    def _note_stamp(self, topic: str, stamp_ns: int) -> None:
        """Discard earlier inputs when the clock of an external robot restarts."""
        newest_ns = self._newest_ns.get(topic, stamp_ns)
        if self.began_ns is None or stamp_ns < newest_ns - RESTARTED_NS:
            newest_ns = self.began_ns = stamp_ns
            self._inputs = self._aligner()
            self._evaluator.restart_clock()
            self._last_truth = None
        self._newest_ns[topic] = max(newest_ns, stamp_ns)

    def _collect(self, topic: str, stamp_ns: int, raw: bytes) -> None:
        self._received_s = time.monotonic()
        self._note_stamp(topic, stamp_ns)
        value: object = raw
        if topic == topics.GROUND_TRUTH:
            value = truth = odometry_from_raw(raw)
            self._last_truth = (stamp_ns, truth.pose)
        for tick_ns, inputs in self._inputs.add(topic, stamp_ns, value, self._received_s):
            if self._ticks == 0:  # the ends of paths are received once their ticks are
                kind, name = DiagnosticArray, topics.TRANSITION
                subscribe_raw(self, kind, name, self._on_action, DEEP_QOS)
            self._ticks += 1
            if self._ticks % _ACKNOWLEDGED_TICKS == 0:
                self._acknowledger.acknowledge(tick_ns)
            judged = topics.GROUND_TRUTH in inputs
            truth_pose = inputs[topics.GROUND_TRUTH].pose if judged else None
            self._on_tick(tick_ns, truth_pose, inputs[topics.STATE])

    def _on_tick(self, stamp_ns: int, truth: Pose2 | None, raw_state: bytes) -> None:
        state = state_from_raw(raw_state)
        certain = state.confidence is Confidence.OK
        if truth is None:
            if not certain:
                return
            truth = state.pose
            self._last_truth = (stamp_ns, truth)
        heading_rad = None
        if certain:
            heading_rad = blend_heading(self._mode, state.mu_x, state.mu_y, self._policy)
        tick = Tick(
            time_ns=stamp_ns,
            truth=truth,
            estimate=state.pose if certain else None,
            commanded_heading_rad=heading_rad,
        )
        for result in self._evaluator.add_tick(tick):
            self._on_path(result)

    def _on_action(self, stamp_ns: int, raw: bytes) -> None:
        transition = transition_from_raw(raw)
        if transition.outcome is None:
            return
        if transition.outcome is PathOutcome.GOAL:
            self._evaluator.move_goal(transition.next_state)
        for result in self._evaluator.add_outcome(stamp_ns, transition.path, transition.outcome):
            self._on_path(result)

    def _evaluate_pending(self) -> None:
        """Evaluate paths whose last ticks were lost: after the last path no more arrive."""
        if self._last_truth is not None:
            self._acknowledger.acknowledge(self._last_truth[0])
        if time.monotonic() - self._received_s > _SILENCE_S:
            for result in self._evaluator.evaluate_pending():
                self._on_path(result)

    def _on_q_table(self, _: int, raw: bytes) -> None:
        q = q_table_from_raw(raw)
        if np.array_equal(q, self._policy.q):
            return
        policy = Policy.of_table(q, self._evaluator.regions)
        if policy is None:
            raise MessageError(f'{q.shape} does not fit the regions')
        self._policy = policy
