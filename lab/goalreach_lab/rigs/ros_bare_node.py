"""A node that only imports rclpy: the floor of memory and of start-up time.

python -m goalreach_lab.rigs.ros_bare_node NAME
"""

import contextlib
import sys

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor

_SPIN_S = 0.25


def main() -> None:
    """Spin until SIGINT or SIGTERM."""
    rclpy.init(args=[])
    node = rclpy.create_node(sys.argv[1])
    executor = EventsExecutor()
    executor.add_node(node)
    try:
        with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
            while rclpy.ok():
                executor.spin_once(timeout_sec=_SPIN_S)
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
