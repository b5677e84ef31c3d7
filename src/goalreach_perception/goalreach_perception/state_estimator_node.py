"""The `state_estimator` node: from the pose to the region and its fuzzy memberships."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.node import Node

from goalreach_msgs_py.regions import region_name
from goalreach_msgs_py.ros_common_messages import MessageError, stamp_from_msg
from goalreach_msgs_py.ros_estimate_messages import estimate_from_msg, state_to_msg
from goalreach_msgs_py.ros_node import Diagnostics, Outbox, run_nodes
from goalreach_msgs_py.ros_parameters import NodeConfig
from goalreach_msgs_py.ros_qos import RELIABLE_QOS
from goalreach_msgs_py.topics import POSE, STATE
from goalreach_msgs_py.values import Confidence
from goalreach_perception.state_estimator import StateEstimator, StateEstimatorConfig

__all__ = ['StateEstimatorNode', 'main']

_NAME = 'state_estimator'
_THROTTLE_S = 5.0


class StateEstimatorNode(Node):
    """Adapter of one `StateEstimator`.

    Publishes: `/state` with the stamp of the pose; `/diagnostics`.
    Subscribes: `/pose`.
    Parameters: the fields of `StateEstimatorConfig`.
    """

    def __init__(self) -> None:
        """Declare and build."""
        super().__init__(_NAME)
        self._estimator = StateEstimator(NodeConfig(self, StateEstimatorConfig).value)
        self._outbox = Outbox()
        self._diagnostics = Diagnostics(self)
        self._state = self.create_publisher(DiagnosticArray, STATE, RELIABLE_QOS)
        self.create_subscription(PoseWithCovarianceStamped, POSE, self._on_pose, RELIABLE_QOS)

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        stamp_ns = stamp_from_msg(message.header.stamp)
        if not self._outbox.open(stamp_ns):
            return
        try:
            state = self._estimator.estimate(estimate_from_msg(message))
        except MessageError as error:
            self.get_logger().error(f'{POSE}: {error}', throttle_duration_sec=_THROTTLE_S)
            return
        self._outbox.send(self._state, state_to_msg(state, stamp_ns))
        self._diagnostics.tick(
            stamp_ns,
            state.confidence.value,
            lambda: {'region': region_name(state.region)},
            ok=state.confidence is Confidence.OK,
        )


def main() -> None:
    """Run the node until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes(_NAME, [StateEstimatorNode]))


if __name__ == '__main__':
    main()
