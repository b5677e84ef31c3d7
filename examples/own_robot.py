"""A robot of one's own that only moves and sees: a base, a fixed camera, three LEDs in the dark.

    python3 examples/own_robot.py
    goalreach run --external nomad200 --params-file examples/own_robot.yaml --paths 1

It has no bumpers, joints, services or truth. `move` and `see` stand for your base and camera.
"""

import contextlib
import math

from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image

LEDS_M = np.array([(0.889, 0.0, 1.422), (1.778, 0.508, 1.829), (2.667, 0.0, 1.626)])
EYE_M, FOCAL_PX, ROWS, COLUMNS = 1.1, 320.0, np.arange(480), np.arange(640)
NEAREST_M, PERIOD_S, WATCHDOG_S = 0.1, 0.04, 0.5
SENDS = {Odometry: '/odom', CameraInfo: '/camera/camera_info', Image: '/camera/image_raw'}


class OwnRobot(Node):
    """Publishes images, calibration and odometry 25 times a second; obeys /cmd_vel."""

    def __init__(self) -> None:
        super().__init__('own_robot')
        self.out = {kind: self.create_publisher(kind, topic, 10) for kind, topic in SENDS.items()}
        self.create_subscription(TwistStamped, '/cmd_vel', self.obey, 10)
        self.create_timer(PERIOD_S, self.tick)
        self.rng, self.place, self.heading = np.random.default_rng(0), 1.6 + 3.6j, -math.pi / 2
        self.ahead = self.turn = self.obeyed_s = 0.0

    def obey(self, message: TwistStamped) -> None:
        """Take a command."""
        self.ahead, self.turn = message.twist.linear.x, message.twist.angular.z
        self.obeyed_s = self.get_clock().now().nanoseconds / 1e9

    def move(self, now_s: float) -> None:
        """Move for a period; stand half a second after the last command."""
        moves_s = PERIOD_S * (now_s - self.obeyed_s < WATCHDOG_S)
        self.heading += self.turn * moves_s
        self.place += self.ahead * moves_s * np.exp(1j * self.heading)

    def see(self) -> bytes:
        """Return the grey values of a camera that looks ahead: a spot for each LED, and noise."""
        light, ahead = self.rng.normal(8.0, 1.0, (480, 640)), np.exp(1j * self.heading)
        for east, north, up in LEDS_M:
            away = (complex(east, north) - self.place) / ahead
            if away.real > NEAREST_M:
                u = 319.5 - FOCAL_PX * away.imag / away.real - COLUMNS
                v = 239.5 - FOCAL_PX * (up - EYE_M) / away.real - ROWS
                light += 200 * np.outer(np.exp(-(v**2) / 2.88), np.exp(-(u**2) / 2.88))
        return light.clip(0, 255).astype(np.uint8).tobytes()

    def tick(self) -> None:
        """Move, look, and send what was measured with one stamp."""
        now, odometry = self.get_clock().now(), Odometry(child_frame_id='base_link')
        self.move(now.nanoseconds / 1e9)
        at, rotation = odometry.pose.pose.position, odometry.pose.pose.orientation
        at.x, at.y = self.place.real, self.place.imag
        rotation.z, rotation.w = math.sin(self.heading / 2), math.cos(self.heading / 2)
        info = CameraInfo(height=480, width=640, distortion_model='plumb_bob', d=[0.0] * 5)
        info.k = [FOCAL_PX, 0.0, 319.5, 0.0, FOCAL_PX, 239.5, 0.0, 0.0, 1.0]
        image = Image(height=480, width=640, encoding='mono8', step=640)
        image.data.frombytes(self.see())
        for message, frame in ((odometry, 'odom'), (info, 'camera'), (image, 'camera')):
            message.header.stamp, message.header.frame_id = now.to_msg(), frame
            self.out[type(message)].publish(message)


if __name__ == '__main__':
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException, RuntimeError):
        robot = OwnRobot()
        while rclpy.ok():  # `rclpy.spin` now and then misses SIGTERM
            rclpy.spin_once(robot, timeout_sec=0.1)
