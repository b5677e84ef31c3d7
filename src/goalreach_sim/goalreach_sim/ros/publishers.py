"""Publishers of the simulator: clock, sensors and ground truth of a tick; arena markers."""

from collections.abc import Sequence
import math
import time

import cv2
from geometry_msgs.msg import Point
from nav_msgs.msg import Odometry
import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, LaserScan
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from goalreach_msgs_py import topics
from goalreach_msgs_py.pose_messages import odometry_to_raw
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.ros.messaging import (
    DEEP_QOS,
    RELIABLE_QOS,
    SENSOR_QOS,
    StampedReply,
    header,
)
from goalreach_msgs_py.ros.transforms import (
    TransformPublisher,
    head_transforms,
    odometry_transforms,
    optical_transform,
)
from goalreach_msgs_py.sensor_messages import (
    bumpers_to_raw,
    camera_to_raw,
    clock_to_raw,
    compressed_image_to_raw,
    head_to_raw,
    image_to_raw,
)
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator_config import SimulatorConfig

_COMPRESSED_PERIOD_S = 0.1
"""Least time of the wall clock between two JPEG copies."""
_JPEG_QUALITY = 70

_WALL_HEIGHT_M = 0.5
_WALL_THICKNESS_M = 0.02
_LED_DIAMETER_M = 0.06
_LINE_WIDTH_M = 0.015
_GREY = ColorRGBA(r=0.55, g=0.55, b=0.55, a=1.0)
_RED = ColorRGBA(r=0.84, g=0.37, b=0.0, a=1.0)
_BLUE = ColorRGBA(r=0.0, g=0.45, b=0.70, a=0.8)
_GREEN = ColorRGBA(r=0.0, g=0.62, b=0.45, a=0.25)


class FramePublisher:
    """Publishes the sensor readings and the ground truth of each tick.

    For viewers, it also publishes JPEG copies of the image, at most ten times a second of the wall
    clock, and only while they have subscribers.

    Args:
        node: The node that publishes.
        config: The robot: its radius, camera height and camera rate.
    """

    def __init__(self, node: Node, config: SimulatorConfig) -> None:
        self._config = config
        self._reply = StampedReply()
        self._clock = node.create_publisher(Clock, topics.CLOCK, RELIABLE_QOS)
        self._image = node.create_publisher(Image, topics.IMAGE, SENSOR_QOS)
        self._compressed = node.create_publisher(
            CompressedImage, topics.COMPRESSED_IMAGE, SENSOR_QOS
        )
        self._compressed_s = -math.inf
        self._camera = node.create_publisher(CameraInfo, topics.CAMERA_INFO, SENSOR_QOS)
        self._odom = node.create_publisher(Odometry, topics.ODOM, RELIABLE_QOS)
        self._joints = node.create_publisher(JointState, topics.JOINT_STATES, RELIABLE_QOS)
        self._bumpers = node.create_publisher(LaserScan, topics.BUMPERS, RELIABLE_QOS)
        self._truth = node.create_publisher(Odometry, topics.GROUND_TRUTH, DEEP_QOS)
        self._transforms = TransformPublisher(node, [optical_transform()])

    def publish(self, frame: SensorFrame, stamp_ns: int) -> None:
        """Publish a frame, the image last, since all else is small."""
        send = self._reply.send
        self._reply.begin(stamp_ns)
        send(self._clock, clock_to_raw(stamp_ns))
        send(self._truth, odometry_to_raw(frame.truth, stamp_ns, frame_id=topics.MAP_FRAME))
        send(self._odom, odometry_to_raw(frame.odometry, stamp_ns, frame_id=topics.ODOM_FRAME))
        send(self._joints, head_to_raw(frame.joints, stamp_ns))
        radius_m, scan_s = self._config.body_radius_m, self._config.period_ns * 1e-9
        bumpers = bumpers_to_raw(
            frame.bumpers, stamp_ns, body_radius_m=radius_m, scan_time_s=scan_s
        )
        send(self._bumpers, bumpers)
        send(self._camera, camera_to_raw(frame.camera, stamp_ns))
        send(self._image, image_to_raw(frame.image, stamp_ns))
        self._publish_compressed(frame.image, stamp_ns)
        if self._transforms.active:
            self._transforms.publish(
                odometry_transforms(stamp_ns, frame.odometry.pose, frame.base_yaw_rad)
                + head_transforms(stamp_ns, frame.joints, self._config.camera_height_m)
            )

    def _publish_compressed(self, image: NDArray[np.uint8], stamp_ns: int) -> None:
        """Encode and publish an image if one is due and has subscribers."""
        now_s = time.monotonic()
        due = now_s - self._compressed_s >= _COMPRESSED_PERIOD_S
        if not due or not self._compressed.get_subscription_count():
            return
        self._compressed_s = now_s
        _, jpeg = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        self._compressed.publish(compressed_image_to_raw(jpeg.tobytes(), stamp_ns))

    def repeat(self, stamp_ns: int) -> None:
        """Publish the last frame again, for nodes that have lost it."""
        self._reply.begin(stamp_ns)


def arena_markers(config: SimulatorConfig, regions: RegionMap) -> MarkerArray:
    """Return walls, LEDs, region borders and the goal region as markers in `map`."""
    width_m, length_m = config.arena_width_m, config.arena_length_m
    half_m = _WALL_THICKNESS_M / 2
    walls = (
        (width_m / 2, -half_m, width_m, _WALL_THICKNESS_M),
        (width_m / 2, length_m + half_m, width_m, _WALL_THICKNESS_M),
        (-half_m, length_m / 2, _WALL_THICKNESS_M, length_m),
        (width_m + half_m, length_m / 2, _WALL_THICKNESS_M, length_m),
    )
    markers = [
        _marker('walls', index, (x, y, _WALL_HEIGHT_M / 2), (dx, dy, _WALL_HEIGHT_M), _GREY)
        for index, (x, y, dx, dy) in enumerate(walls)
    ]
    x0, y0, x1, y1 = regions.bounds(regions.goal)
    centre = ((x0 + x1) / 2, (y0 + y1) / 2, 0.0)
    markers.append(_marker('goal', 0, centre, (x1 - x0, y1 - y0, 0.002), _GREEN))
    markers.append(_borders(regions, width_m, length_m))
    size = (_LED_DIAMETER_M,) * 3
    for index, led_m in enumerate(config.landmark_array_m.tolist()):
        markers.append(_marker('leds', index, led_m, size, _RED, shape=Marker.SPHERE))
    return MarkerArray(markers=markers)


def _borders(regions: RegionMap, width_m: float, length_m: float) -> Marker:
    size = (_LINE_WIDTH_M, 0.0, 0.0)
    marker = _marker('regions', 0, (0.0, 0.0, 0.0), size, _BLUE, shape=Marker.LINE_LIST)
    for x in regions.x_borders_m[1:3]:
        marker.points += [Point(x=x, y=0.0), Point(x=x, y=length_m)]
    for y in regions.y_borders_m[1:3]:
        marker.points += [Point(x=0.0, y=y), Point(x=width_m, y=y)]
    return marker


def _marker(
    namespace: str,
    index: int,
    centre: Sequence[float],
    size: tuple[float, ...],
    color: ColorRGBA,
    *,
    shape: int = Marker.CUBE,
) -> Marker:
    marker = Marker(
        header=header(0, topics.MAP_FRAME), ns=namespace, id=index, type=shape, color=color
    )
    marker.pose.position = Point(x=centre[0], y=centre[1], z=centre[2])
    marker.pose.orientation.w = 1.0
    marker.scale.x, marker.scale.y, marker.scale.z = size
    return marker
