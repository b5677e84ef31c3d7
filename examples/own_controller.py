"""A controller of one's own: drives towards the goal in a straight line, over two topics.

Start it, then a run that leaves the driving to it; goalreach's controller only keeps the paths:

    python3 examples/own_controller.py
    goalreach run --paths 3 --external goal_reaching_controller

It needs rclpy and geometry_msgs only. Each command carries the stamp of the pose that it answers,
so that it works in lockstep too.
"""

import contextlib
import math

from geometry_msgs.msg import PoseWithCovarianceStamped, TwistStamped
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

GOAL_X_M, GOAL_Y_M = 1.78, 0.50  # inside the region FRONT/NEAR
LARGEST_DEVIATION_M = 0.2  # with a less certain pose the robot stands
LARGEST_ERROR_RAD = 0.3  # it turns on the spot until the goal is ahead
SPEED_M_PER_S = 0.3
GAIN_PER_S = 2.0


class StraightController(Node):
    """Publishes a command for each pose."""

    def __init__(self) -> None:
        super().__init__('straight_controller')
        self.commands = self.create_publisher(TwistStamped, '/cmd_vel', 10)
        self.create_subscription(PoseWithCovarianceStamped, '/pose', self.answer, 10)

    def answer(self, message: PoseWithCovarianceStamped) -> None:
        """Turn towards the goal, and drive once it is ahead."""
        position, rotation = message.pose.pose.position, message.pose.pose.orientation
        heading_rad = 2 * math.atan2(rotation.z, rotation.w)
        wanted_rad = math.atan2(GOAL_Y_M - position.y, GOAL_X_M - position.x)
        error_rad = math.remainder(wanted_rad - heading_rad, 2 * math.pi)
        command = TwistStamped()
        command.header.stamp = message.header.stamp
        command.header.frame_id = 'base_link'
        if message.pose.covariance[0] < LARGEST_DEVIATION_M**2:
            command.twist.angular.z = max(-1.0, min(1.0, GAIN_PER_S * error_rad))
            command.twist.linear.x = SPEED_M_PER_S * (abs(error_rad) < LARGEST_ERROR_RAD)
        self.commands.publish(command)


def main() -> None:
    """Run until Ctrl-C."""
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        node = StraightController()
        while rclpy.ok():  # `rclpy.spin` now and then misses SIGTERM
            rclpy.spin_once(node, timeout_sec=0.1)


if __name__ == '__main__':
    main()
