"""A localizer of one's own: dead reckoning from a known start, over two topics.

Start it, then a run without the localizer of goalreach, from that start:

    python3 examples/own_localizer.py
    goalreach run --external landmark_localizer --paths 1 --start 1.0,3.0,0

It needs rclpy and standard messages only. Each pose carries the stamp of the odometry that it
answers, and a covariance that grows with the way: once it is too large, the robot stops. It is for
real time: in lockstep the simulator waits until all its sensors have readers.
"""

import contextlib
import math

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

START_X_M, START_Y_M, START_RAD = 1.0, 3.0, 0.0  # pose in the frame map
DEVIATION_PER_M = 0.02  # standard deviation of the position after a metre


class DeadReckoning(Node):
    """Publishes a pose for each odometry message."""

    def __init__(self) -> None:
        super().__init__('dead_reckoning')
        self.poses = self.create_publisher(PoseWithCovarianceStamped, '/pose', 10)
        self.create_subscription(Odometry, '/odom', self.answer, 10)
        self.first: tuple[float, float, float] | None = None
        self.way_m, self.last = 0.0, (0.0, 0.0)

    def answer(self, message: Odometry) -> None:
        """Move the start by what odometry tells."""
        at, turn = message.pose.pose.position, message.pose.pose.orientation
        heading_rad = 2 * math.atan2(turn.z, turn.w)
        if self.first is None:
            self.first, self.last = (at.x, at.y, heading_rad), (at.x, at.y)
        x0, y0, heading0_rad = self.first
        rotation = START_RAD - heading0_rad
        ahead, left = at.x - x0, at.y - y0
        self.way_m += math.hypot(at.x - self.last[0], at.y - self.last[1])
        self.last = at.x, at.y

        pose = PoseWithCovarianceStamped(header=message.header)
        pose.header.frame_id = 'map'
        where = pose.pose.pose
        where.position.x = START_X_M + ahead * math.cos(rotation) - left * math.sin(rotation)
        where.position.y = START_Y_M + ahead * math.sin(rotation) + left * math.cos(rotation)
        where.orientation.z = math.sin((heading_rad + rotation) / 2)
        where.orientation.w = math.cos((heading_rad + rotation) / 2)
        variance = 0.01**2 + (DEVIATION_PER_M * self.way_m) ** 2
        pose.pose.covariance[0] = pose.pose.covariance[7] = pose.pose.covariance[35] = variance
        self.poses.publish(pose)


def main() -> None:
    """Run until Ctrl-C."""
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        node = DeadReckoning()
        while rclpy.ok():  # `rclpy.spin` now and then misses SIGTERM
            rclpy.spin_once(node, timeout_sec=0.1)


if __name__ == '__main__':
    main()
