"""Publishes one tick of the simulator: clock, sensors and ground truth with one stamp."""

from __future__ import annotations

from nav_msgs.msg import Odometry
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan

from goalreach_msgs_py.ros.raw_camera import camera_to_raw, image_to_raw
from goalreach_msgs_py.ros.raw_robot import (
    bumpers_to_raw,
    clock_to_raw,
    head_to_raw,
    odometry_to_raw,
)
from goalreach_msgs_py.ros.stamped_reply import Outbox
from goalreach_msgs_py.ros.subscribe_raw import DEEP_QOS, RELIABLE_QOS, SENSOR_QOS
from goalreach_msgs_py.ros.throttled import Glimpse
from goalreach_msgs_py.ros.transforms import (
    TransformPublisher,
    head_transforms,
    odometry_transforms,
    optical_transform,
)
from goalreach_msgs_py.topics import (
    BUMPERS,
    CAMERA_INFO,
    CLOCK,
    GROUND_TRUTH,
    IMAGE,
    JOINT_STATES,
    MAP_FRAME,
    ODOM,
    ODOM_FRAME,
)
from goalreach_sim.sensors import SensorFrame

_SHOWN = 100
"""Ticks that a glimpse holds at most: twice what the fastest run has between two. Chosen."""


class FramePublisher:
    """The publishers of `nomad200` that send once in a camera period.

    Args:
        node: The node that publishes.
        body_radius_m: Radius told by a pressed bumper.
        camera_height_m: Height of the optical centre, for the transforms.
        period_s: Time between readings.
    """

    def __init__(
        self, node: Node, *, body_radius_m: float, camera_height_m: float, period_s: float
    ) -> None:
        """Make the publishers."""
        self._body_radius_m = body_radius_m
        self._camera_height_m = camera_height_m
        self._period_s = period_s
        history = {GROUND_TRUTH: _SHOWN, BUMPERS: _SHOWN}
        self._outbox = Outbox(Glimpse(node, history=history, picture=IMAGE))
        self._clock = node.create_publisher(Clock, CLOCK, RELIABLE_QOS)
        self._image = node.create_publisher(Image, IMAGE, SENSOR_QOS)
        self._camera = node.create_publisher(CameraInfo, CAMERA_INFO, SENSOR_QOS)
        self._odom = node.create_publisher(Odometry, ODOM, RELIABLE_QOS)
        self._joints = node.create_publisher(JointState, JOINT_STATES, RELIABLE_QOS)
        self._bumpers = node.create_publisher(LaserScan, BUMPERS, RELIABLE_QOS)
        self._truth = node.create_publisher(Odometry, GROUND_TRUTH, DEEP_QOS)
        self._transforms = TransformPublisher(node, [optical_transform()])

    def publish(self, frame: SensorFrame, stamp_ns: int) -> None:
        """Send a frame; the image goes last, since all else is small."""
        send = self._outbox.send
        self._outbox.open(stamp_ns)
        send(self._clock, clock_to_raw(stamp_ns))
        send(self._truth, odometry_to_raw(frame.truth, stamp_ns, frame_id=MAP_FRAME))
        send(self._odom, odometry_to_raw(frame.odometry, stamp_ns, frame_id=ODOM_FRAME))
        send(self._joints, head_to_raw(frame.joints, stamp_ns))
        send(
            self._bumpers,
            bumpers_to_raw(
                frame.bumpers,
                stamp_ns,
                body_radius_m=self._body_radius_m,
                scan_time_s=self._period_s,
            ),
        )
        send(self._camera, camera_to_raw(frame.camera, stamp_ns))
        send(self._image, image_to_raw(frame.image, stamp_ns))
        self._outbox.close()
        if self._transforms.active:
            self._transforms.publish(
                odometry_transforms(stamp_ns, frame.odometry.pose, frame.base_yaw_rad)
                + head_transforms(stamp_ns, frame.joints, self._camera_height_m)
            )

    def repeat(self, stamp_ns: int) -> None:
        """Send the last frame again, for those who have not heard it."""
        self._outbox.open(stamp_ns)
