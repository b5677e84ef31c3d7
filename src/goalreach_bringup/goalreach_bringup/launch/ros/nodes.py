"""All nodes of the graph: imported at once by the fork server, or run in one process."""

import gc

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Log
from rclpy.type_support import check_for_type_support
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from std_srvs.srv import Empty
from type_description_interfaces.srv import GetTypeDescription
from visualization_msgs.msg import MarkerArray

from goalreach_learning.goal_reaching_controller_node import GoalReachingControllerNode
from goalreach_msgs_py.ros.node import run_nodes
from goalreach_perception.landmark_localizer_node import LandmarkLocalizerNode
from goalreach_perception.state_estimator_node import StateEstimatorNode
from goalreach_sim.nomad200_node import Nomad200Node

_CLASSES = (Nomad200Node, LandmarkLocalizerNode, StateEstimatorNode, GoalReachingControllerNode)

# One type of each package of messages that the nodes use: it loads the libraries of the package.
for _type in (
    Clock,
    DiagnosticArray,
    Empty,
    GetTypeDescription,
    Image,
    Log,
    MarkerArray,
    Odometry,
    TwistStamped,
):
    check_for_type_support(_type)
gc.freeze()  # collections in forked processes leave the shared pages alone


def main() -> None:
    """Run all nodes in this process until Ctrl-C or SIGTERM."""
    raise SystemExit(run_nodes('composed', _CLASSES))
