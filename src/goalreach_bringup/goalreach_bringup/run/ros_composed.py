"""All four nodes in one process, on one executor."""

from __future__ import annotations

import sys

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from goalreach_learning.goal_reaching_controller_node import GoalReachingControllerNode
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros_node import end_with_launcher, spin_until_shutdown
from goalreach_perception.landmark_localizer_node import LandmarkLocalizerNode
from goalreach_perception.state_estimator_node import StateEstimatorNode
from goalreach_sim.nomad200_node import Nomad200Node

__all__ = ['main']

_CLASSES = (
    Nomad200Node,
    LandmarkLocalizerNode,
    StateEstimatorNode,
    GoalReachingControllerNode,
)


def main() -> int:
    """Run the nodes until Ctrl-C or SIGTERM; return the exit status."""
    end_with_launcher()
    nodes: list[Node] = []
    try:
        rclpy.init(args=sys.argv)
        nodes.extend(cls() for cls in _CLASSES)
        spin_until_shutdown(nodes)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except GoalreachError as error:
        sys.stderr.write(f'{error}\n')
        return 2
    finally:
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
