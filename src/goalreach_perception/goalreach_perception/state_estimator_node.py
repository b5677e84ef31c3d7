"""The `state_estimator` node: from the pose to region and fuzzy memberships."""

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from goalreach_msgs_py.diagnostic_messages import state_to_raw
from goalreach_msgs_py.pose_messages import estimate_from_raw
from goalreach_msgs_py.regions import region_name
from goalreach_msgs_py.ros.messaging import (
    DEEP_QOS,
    RELIABLE_QOS,
    SENSOR_QOS,
    InputReporter,
    StampedReply,
    advertise,
    frame_prefix,
    subscribe_raw,
)
from goalreach_msgs_py.ros.node import Diagnostics, run_nodes
from goalreach_msgs_py.ros.parameters import NodeConfig
from goalreach_msgs_py.topics import CLOCK, POSE, STATE
from goalreach_msgs_py.values import Confidence
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig

_NAME = 'state_estimator'


class StateEstimatorNode(Node):
    """Adapter of one `StateEstimator`.

    Publishes: `/state` with the stamp of the pose; `/diagnostics`.
    Subscribes: `/pose`; `/clock`: a pose whose stamp is too far from it, either way, is STALE.
    Parameters: the fields of `StateEstimatorConfig`; `goal` may change while it runs.
    """

    def __init__(self) -> None:
        super().__init__(_NAME)
        config = NodeConfig(self, StateEstimatorConfig, live=('goal',), on_change=self._on_config)
        self._on_config(config.value)
        self._reply = StampedReply()
        self._prefix = frame_prefix(self)
        self._diagnostics = Diagnostics(self, self._reply)
        self._state = advertise(self, DiagnosticArray, STATE, DEEP_QOS)
        self._reporter = InputReporter(self, [POSE])
        self._clock_ns: int | None = None
        self._period_ns = 0
        subscribe_raw(self, PoseWithCovarianceStamped, POSE, self._on_pose, RELIABLE_QOS)
        subscribe_raw(self, Clock, CLOCK, self._on_clock, SENSOR_QOS)

    def _on_config(self, config: StateEstimatorConfig) -> None:
        self._estimator = StateEstimator(config)

    def _on_clock(self, now_ns: int, _raw: bytes) -> None:
        self._period_ns = 0 if self._clock_ns is None else now_ns - self._clock_ns
        self._clock_ns = now_ns
        self._reporter.received(CLOCK, now_ns)

    def _age_s(self, stamp_ns: int) -> float:
        """Return the distance of a stamp from the clock, seconds; 0 before the first clock.

        A pose may arrive before the clock message of the same tick.
        """
        if self._clock_ns is None:
            return 0.0
        age_ns = self._clock_ns - stamp_ns
        return max(age_ns, -age_ns - self._period_ns) * 1e-9

    def _on_pose(self, stamp_ns: int, raw: bytes) -> None:
        self._reporter.received(POSE, stamp_ns)
        if not self._reply.begin(stamp_ns):
            return
        pose = estimate_from_raw(raw)
        state = self._estimator.estimate(pose, age_s=self._age_s(stamp_ns))
        self._reply.send(self._state, state_to_raw(state, stamp_ns, self._prefix))
        self._diagnostics.tick(
            stamp_ns,
            state.confidence.value,
            lambda: {'region': region_name(state.region, (len(state.mu_x), len(state.mu_y)))},
            ok=state.confidence is Confidence.OK,
        )


def main() -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes(_NAME, [StateEstimatorNode]))


if __name__ == '__main__':
    main()
