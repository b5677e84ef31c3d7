"""A process that has imported all that nodes need, and waits to become one of them.

Most of the time from the death of a node to its next life goes into importing libraries, those of
the message types among them; here that has been done before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import json
import signal
import sys
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Log, ParameterEvent
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.type_support import check_for_type_support
from sensor_msgs.msg import Image

from goalreach_bringup.launch.ros import composed
from goalreach_learning import goal_reaching_controller_node
from goalreach_msgs_py.ros.node import call_process, end_with_launcher
from goalreach_perception import landmark_localizer_node, state_estimator_node
from goalreach_sim import nomad200_node

_MAINS: Final[Mapping[str, Callable[[], None]]] = {
    'nomad200': nomad200_node.main,
    'landmark_localizer': landmark_localizer_node.main,
    'state_estimator': state_estimator_node.main,
    'goal_reaching_controller': goal_reaching_controller_node.main,
    'composed': composed.main,
}

_TYPES: Final[tuple[Any, ...]] = (
    DiagnosticArray, GetParameters, Image, Log, ParameterEvent, SetParameters,
)  # fmt: skip
"""What every node speaks; they bring the libraries of most others."""


def main() -> None:
    """Wait for one line, a JSON list of a node's name and its arguments; then be that node."""
    call_process('spare')
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    end_with_launcher()
    for message_type in _TYPES:
        check_for_type_support(message_type)
    line = sys.stdin.readline()
    if not line:  # the launcher has no use for it any more
        return
    sys.argv = json.loads(line)
    _MAINS[sys.argv[0]]()


if __name__ == '__main__':
    main()
