"""All nodes of the graph: imported at once by the fork server, or run in one process."""

import gc

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Log, ParameterEvent
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.type_support import check_for_type_support
from sensor_msgs.msg import Image

from goalreach_learning.goal_reaching_controller_node import GoalReachingControllerNode
from goalreach_msgs_py.ros.node import run_nodes
from goalreach_perception.landmark_localizer_node import LandmarkLocalizerNode
from goalreach_perception.state_estimator_node import StateEstimatorNode
from goalreach_sim.nomad200_node import Nomad200Node

_CLASSES = (Nomad200Node, LandmarkLocalizerNode, StateEstimatorNode, GoalReachingControllerNode)

# Every node uses these types; loading their libraries loads most others.
for _message_type in (DiagnosticArray, GetParameters, Image, Log, ParameterEvent, SetParameters):
    check_for_type_support(_message_type)
gc.freeze()  # collections in forked processes leave the shared pages alone


def main() -> None:
    """Run all nodes in this process until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes('composed', _CLASSES))


if __name__ == '__main__':
    main()
