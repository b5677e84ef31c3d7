"""Publishers of the simulator: clock, sensors and ground truth of a tick; arena markers."""

from collections.abc import Iterable, Sequence
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

from goalreach_msgs_py import sensor_messages, topics
from goalreach_msgs_py.image_messages import compressed_image_to_raw, image_to_raw
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.pose_messages import odometry_to_raw
from goalreach_msgs_py.regions import RegionMap
from goalreach_msgs_py.ros import transforms
from goalreach_msgs_py.ros.messaging import (
    DEEP_QOS,
    RELIABLE_QOS,
    StampedReply,
    advertise,
    frame_prefix,
    header,
)
from goalreach_msgs_py.values import PathOutcome
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator_config import SimulatorConfig
from goalreach_sim.sonar import FARTHEST_M, NEAREST_M

_COMPRESSED_PERIOD_S = 0.1
"""Least time of the wall clock between two JPEG copies."""
_JPEG_QUALITY = 70

_WALL_HEIGHT_M = 0.5
_WALL_THICKNESS_M = 0.02
_LED_DIAMETER_M = 0.06
_LINE_WIDTH_M = 0.015
_GREY = ColorRGBA(r=0.55, g=0.55, b=0.55, a=1.0)
_RED = ColorRGBA(r=0.84, g=0.37, b=0.0, a=1.0)
_BROWN = ColorRGBA(r=0.45, g=0.30, b=0.15, a=1.0)
_BLUE = ColorRGBA(r=0.0, g=0.45, b=0.70, a=0.8)
_GREEN = ColorRGBA(r=0.0, g=0.62, b=0.45, a=0.25)


class FramePublisher:
    """Publishes the sensor readings and the ground truth of each tick.

    For viewers, it also publishes JPEG copies of the image, at most ten times a second of the wall
    clock, and only while they have subscribers.
    """

    def __init__(self, node: Node, config: SimulatorConfig, reply: StampedReply) -> None:
        self._config = config
        self._prefix = frame_prefix(node)
        self._reply = reply
        self._clock = advertise(node, Clock, topics.CLOCK, RELIABLE_QOS)
        self._image = advertise(node, Image, topics.IMAGE, RELIABLE_QOS)
        self._compressed = advertise(node, CompressedImage, topics.COMPRESSED_IMAGE, RELIABLE_QOS)
        self._compressed_s = -math.inf
        self._camera = advertise(node, CameraInfo, topics.CAMERA_INFO, RELIABLE_QOS)
        self._odom = advertise(node, Odometry, topics.ODOM, RELIABLE_QOS)
        self._joints = advertise(node, JointState, topics.JOINT_STATES, RELIABLE_QOS)
        self._bumpers = advertise(node, LaserScan, topics.BUMPERS, RELIABLE_QOS)
        if config.sonar:
            self._sonar = advertise(node, LaserScan, topics.SONAR, RELIABLE_QOS)
        self._truth = advertise(node, Odometry, topics.GROUND_TRUTH, DEEP_QOS)
        self._transforms = transforms.TransformPublisher(node, [transforms.optical_transform()])

    def publish(self, frame: SensorFrame, stamp_ns: int) -> None:
        """Publish a frame, the image last, since all else is small."""
        send, prefix = self._reply.send, self._prefix
        self._reply.begin(stamp_ns)
        send(self._clock, sensor_messages.clock_to_raw(stamp_ns))
        map_frame, odom_frame = topics.MAP_FRAME, topics.ODOM_FRAME
        send(self._truth, odometry_to_raw(frame.truth, stamp_ns, prefix, frame_id=map_frame))
        send(self._odom, odometry_to_raw(frame.odometry, stamp_ns, prefix, frame_id=odom_frame))
        send(self._joints, sensor_messages.head_to_raw(frame.joints, stamp_ns, prefix))
        radius_m, scan_s = self._config.body_radius_m, self._config.period_ns * 1e-9
        bumpers = sensor_messages.bumpers_to_raw(
            frame.bumpers, stamp_ns, prefix, body_radius_m=radius_m, scan_time_s=scan_s
        )
        send(self._bumpers, bumpers)
        if self._config.sonar:
            limits_m = (radius_m + NEAREST_M * 0.9, radius_m + FARTHEST_M)
            sonar = sensor_messages.sonar_to_raw(
                frame.sonar, stamp_ns, prefix, limits_m=limits_m, scan_time_s=scan_s
            )
            send(self._sonar, sonar)
        send(self._camera, sensor_messages.camera_to_raw(frame.camera, stamp_ns, prefix))
        send(self._image, image_to_raw(frame.image, stamp_ns, prefix))
        self._publish_compressed(frame.image, stamp_ns)
        if self._transforms.active:
            self._transforms.publish(
                transforms.odometry_transforms(stamp_ns, frame.odometry.pose, frame.base_yaw_rad)
                + transforms.head_transforms(stamp_ns, frame.joints, self._config.camera_height_m)
            )

    def _publish_compressed(self, image: NDArray[np.uint8], stamp_ns: int) -> None:
        """Encode and publish an image if one is due and has subscribers."""
        now_s = time.monotonic()
        due = now_s - self._compressed_s >= _COMPRESSED_PERIOD_S
        if not due or not self._compressed.get_subscription_count():
            return
        self._compressed_s = now_s
        _, jpeg = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        self._compressed.publish(compressed_image_to_raw(jpeg.tobytes(), stamp_ns, self._prefix))


def obstacle_markers(obstacles: Iterable[Obstacle], prefix: str) -> MarkerArray:
    """Return obstacles as markers in `map`."""
    markers, frame = MarkerArray(), prefix + topics.MAP_FRAME
    for index, one in enumerate(obstacles):
        diameter_m, shape = 2.0 * one.radius_m, Marker.CYLINDER if one.radius_m else Marker.CUBE
        size = (one.length_m or diameter_m, one.width_m or diameter_m, one.height_m)
        centre = (one.x_m, one.y_m, one.height_m / 2)
        marker = _marker(frame, 'obstacles', index, centre, size, color=_BROWN, shape=shape)
        marker.pose.orientation.z = math.sin(one.heading_rad / 2)
        marker.pose.orientation.w = math.cos(one.heading_rad / 2)
        markers.markers.append(marker)
    return markers


def arena_markers(config: SimulatorConfig, regions: RegionMap, prefix: str) -> MarkerArray:
    """Return walls, LEDs, obstacles, region borders and the goal region as markers in `map`."""
    width_m, length_m = config.arena_width_m, config.arena_length_m
    frame = prefix + topics.MAP_FRAME
    thick_m, high_m = _WALL_THICKNESS_M, _WALL_HEIGHT_M
    walls = (
        (width_m / 2, -thick_m / 2, width_m, thick_m),
        (width_m / 2, length_m + thick_m / 2, width_m, thick_m),
        (-thick_m / 2, length_m / 2, thick_m, length_m),
        (width_m + thick_m / 2, length_m / 2, thick_m, length_m),
    )
    markers = [
        _marker(frame, 'walls', index, (x, y, high_m / 2), (dx, dy, high_m), color=_GREY)
        for index, (x, y, dx, dy) in enumerate(walls)
    ]
    for index, (region, outcome) in enumerate(regions.ends.items()):
        x0, y0, x1, y1 = regions.bounds(region)
        centre, size = ((x0 + x1) / 2, (y0 + y1) / 2, 0.0), (x1 - x0, y1 - y0, 0.002)
        color = _GREEN if outcome is PathOutcome.GOAL else _RED
        markers.append(_marker(frame, outcome.value, index, centre, size, color=color))
    origin, line = (0.0, 0.0, 0.0), (_LINE_WIDTH_M, 0.0, 0.0)
    borders = _marker(frame, 'regions', 0, origin, line, color=_BLUE, shape=Marker.LINE_LIST)
    for x in regions.x_borders_m[1:-1]:
        borders.points += [Point(x=x, y=0.0), Point(x=x, y=length_m)]
    for y in regions.y_borders_m[1:-1]:
        borders.points += [Point(x=0.0, y=y), Point(x=width_m, y=y)]
    markers.append(borders)
    size = (_LED_DIAMETER_M,) * 3
    for index, led_m in enumerate(config.landmark_array_m.tolist()):
        markers.append(_marker(frame, 'leds', index, led_m, size, color=_RED, shape=Marker.SPHERE))
    obstacles = obstacle_markers((one.after(0.0) for one in config.obstacle_list), prefix)
    return MarkerArray(markers=markers + obstacles.markers)


def _marker(
    frame: str,
    namespace: str,
    index: int,
    centre: Sequence[float],
    size: tuple[float, ...],
    *,
    color: ColorRGBA,
    shape: int = Marker.CUBE,
) -> Marker:
    marker = Marker(header=header(0, frame), ns=namespace, id=index, type=shape, color=color)
    marker.pose.position = Point(x=centre[0], y=centre[1], z=centre[2])
    marker.pose.orientation.w = 1.0
    marker.scale.x, marker.scale.y, marker.scale.z = size
    return marker
