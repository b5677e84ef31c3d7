"""The launcher's own node: evaluates the paths that the graph drives."""

from collections.abc import Callable, Sequence
from dataclasses import replace
import time

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
import numpy as np
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray

from goalreach_bringup.launch.path_evaluator import PathEvaluator, Progress, Tick
from goalreach_evaluation.path_metrics import PathResult
from goalreach_learning.blending import blend_heading
from goalreach_learning.policy import Policy
from goalreach_msgs_py.diagnostic_messages import (
    q_table_from_raw,
    state_from_raw,
    transition_from_raw,
)
from goalreach_msgs_py.inputs import StampSynchronizer
from goalreach_msgs_py.pose_messages import odometry_from_raw
from goalreach_msgs_py.ros.acknowledgement import Acknowledger
from goalreach_msgs_py.ros.messaging import DEEP_QOS, LATCHED_QOS, steady_timer, subscribe_raw
from goalreach_msgs_py.topics import GROUND_TRUTH, MONITOR, Q_TABLE, STATE, TRANSITION
from goalreach_msgs_py.values import Confidence, Pose2

_SILENCE_S = 1.0
"""An outcome whose tick is missing after this long without messages is judged without. Chosen."""
_WINDOW_TICKS = 100
"""Half of what the queues hold, so that none is lost; hardly ever full, since evaluating a tick
costs less than making it. Chosen."""
_ACKNOWLEDGED_TICKS = 10
"""Number of ticks per acknowledgement; chosen."""


class RunMonitor(Node):
    """Follows truth, state and transitions and passes finished paths to the launcher.

    Publishes: acknowledgements of ticks (see `Acknowledger`).
    Subscribes: `/ground_truth/odom`, `/state`, `/q_learning/q_table`, and, once it has received
    a whole tick, `/q_learning/transition`: the controller waits for that subscription before its
    first path, so that no path is missed.

    Args:
        starts: Start poses in the order driven.
        policy: The policy of the controller, for its regions and the commanded heading.
        mode: Mode of the controller.
        on_path: Called with the result of each finished path.
        first_path: Number of the first path.
        remaps: ROS 2 remapping rules of the graph.
    """

    def __init__(
        self,
        *,
        starts: Sequence[Pose2],
        policy: Policy,
        mode: str,
        on_path: Callable[[PathResult], None],
        first_path: int = 0,
        remaps: Sequence[str] = (),
    ) -> None:
        rules = [word for rule in remaps for word in ('--remap', rule)]
        super().__init__(MONITOR, cli_args=['--ros-args', *rules] if rules else None)
        self._policy = policy
        self._mode = mode
        self._on_path = on_path
        self._evaluator = PathEvaluator(starts, policy.regions, first_path=first_path)
        self._last_truth: tuple[int, bytes] | None = None
        self._received_s = time.monotonic()
        self._inputs = StampSynchronizer([GROUND_TRUTH, STATE], depth=200)
        for message_type, topic in ((Odometry, GROUND_TRUTH), (DiagnosticArray, STATE)):
            subscribe_raw(self, message_type, topic, self._collector(topic), DEEP_QOS)
        self._receives_transitions = False
        self.create_subscription(
            Float64MultiArray, Q_TABLE, self._on_q_table, LATCHED_QOS, raw=True
        )
        self._acknowledger = Acknowledger(self, window_ticks=_WINDOW_TICKS)
        self._ticks = 0
        steady_timer(self, _SILENCE_S, self._evaluate_pending)

    @property
    def progress(self) -> Progress:
        """Progress of the run; its clock and pose are the last received, evaluated or not."""
        progress = self._evaluator.progress
        if self._last_truth is None:
            return progress
        stamp_ns, raw = self._last_truth
        if stamp_ns <= progress.last_ns:
            return progress
        return replace(progress, last_ns=stamp_ns, truth=_truth(raw))

    @property
    def unjudged(self) -> int:
        """Number of paths that ended and could not be judged."""
        return len(self._evaluator.unjudged)

    def _collector(self, topic: str) -> Callable[[int, bytes], None]:
        def collect(stamp_ns: int, raw: bytes) -> None:
            self._received_s = time.monotonic()
            if topic == GROUND_TRUTH:
                self._last_truth = (stamp_ns, raw)
            inputs = self._inputs.add(topic, stamp_ns, raw)
            if inputs is not None:
                self._subscribe_to_transitions()
                self._ticks += 1
                if self._ticks % _ACKNOWLEDGED_TICKS == 0:
                    self._acknowledger.acknowledge(stamp_ns)
                self._on_tick(stamp_ns, inputs[GROUND_TRUTH], inputs[STATE])

        return collect

    def _subscribe_to_transitions(self) -> None:
        """Receive the ends of paths, now that their ticks are received."""
        if not self._receives_transitions:
            self._receives_transitions = True
            subscribe_raw(self, DiagnosticArray, TRANSITION, self._on_action, DEEP_QOS)

    def _on_tick(self, stamp_ns: int, truth: bytes, raw_state: bytes) -> None:
        state = state_from_raw(raw_state)
        certain = state.confidence is Confidence.OK
        heading_rad = None
        if certain:
            heading_rad = blend_heading(self._mode, state.mu_x, state.mu_y, self._policy)
        tick = Tick(
            time_ns=stamp_ns,
            truth=_truth(truth),
            estimate=state.pose if certain else None,
            commanded_heading_rad=heading_rad,
        )
        for result in self._evaluator.add_tick(tick):
            self._on_path(result)

    def _on_action(self, stamp_ns: int, raw: bytes) -> None:
        transition = transition_from_raw(raw)
        if transition.outcome is None:
            return
        for result in self._evaluator.add_outcome(stamp_ns, transition.path, transition.outcome):
            self._on_path(result)

    def _evaluate_pending(self) -> None:
        """Evaluate paths whose last ticks were lost: after the last path no more arrive."""
        if self._last_truth is not None:
            self._acknowledger.acknowledge(self._last_truth[0])
        if (
            self._evaluator.has_pending_outcome
            and time.monotonic() - self._received_s > _SILENCE_S
        ):
            for result in self._evaluator.evaluate_pending():
                self._on_path(result)

    def _on_q_table(self, raw: bytes) -> None:
        q = q_table_from_raw(raw)
        if not np.array_equal(q, self._policy.q):
            tried = (q != 0).astype(np.int64)
            self._policy = replace(self._policy, q=q, visits=tried)


def _truth(raw: bytes) -> Pose2:
    return odometry_from_raw(raw).pose
