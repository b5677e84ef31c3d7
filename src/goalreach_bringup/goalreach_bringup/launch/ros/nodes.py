"""The processes of the nodes, and what the fork server imports for all of them."""

import gc
from importlib import import_module
from itertools import takewhile
from pkgutil import resolve_name
import sys

from goalreach_bringup.launch.child_process import NODE_CLASSES

_SHARED = ('cv2', 'goalreach_msgs_py.ros.node')
"""Large modules that more than one node imports: OpenCV shared by two saves 8 MB."""


def _preload() -> None:
    """Import what is shared, and load the libraries of every package of messages."""
    gc.disable()  # until the loop of a node begins
    for module in _SHARED:
        import_module(module)
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

    for message in (DiagnosticArray, TwistStamped, Odometry, Log, Clock, Image, MarkerArray):
        check_for_type_support(message)
    for service in (Empty, GetTypeDescription):
        check_for_type_support(service)
    gc.freeze()  # collections in forked processes leave the shared pages alone


_preload()


def main() -> None:
    """Run the nodes that the command line names, until Ctrl-C or SIGTERM."""
    from goalreach_msgs_py.ros.node import run_nodes

    names = takewhile(lambda word: word != '--ros-args', sys.argv[1:])
    raise SystemExit(run_nodes(sys.argv[0], [resolve_name(NODE_CLASSES[node]) for node in names]))
