"""Nodes that publish what those of a run publish, tick by tick, when a test asks them to."""

from __future__ import annotations

from array import array
from typing import Any

import cv2
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry as OdometryMsg
import numpy as np
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, LaserScan

from goalreach_msgs_py import topics
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.diagnostic_messages import state_to_raw, transition_to_raw
from goalreach_msgs_py.image_messages import image_to_raw
from goalreach_msgs_py.pose_messages import estimate_to_raw, odometry_to_raw, twist_to_raw
from goalreach_msgs_py.ros.messaging import DEEP_QOS, header
from goalreach_msgs_py.sensor_messages import (
    bumpers_to_raw,
    camera_to_raw,
    clock_to_raw,
    head_to_raw,
    landmarks_to_raw,
)
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, LOCALIZER, ROBOT
from goalreach_msgs_py.values import (
    Confidence,
    HeadAngles,
    LandmarkObservation,
    Odometry,
    Pose2,
    PoseEstimate,
    RegionState,
    Transition,
    Twist2,
)

PERIOD_NS = 40_000_000
_PUBLISHED: dict[str, dict[str, type[Any]]] = {
    ROBOT: {
        topics.CLOCK: Clock,
        topics.GROUND_TRUTH: OdometryMsg,
        topics.ODOM: OdometryMsg,
        topics.JOINT_STATES: JointState,
        topics.BUMPERS: LaserScan,
        topics.CAMERA_INFO: CameraInfo,
        topics.IMAGE: Image,
        topics.COMPRESSED_IMAGE: CompressedImage,
    },
    LOCALIZER: {
        topics.POSE: PoseWithCovarianceStamped,
        topics.HEAD_COMMAND: JointState,
        topics.LANDMARKS: PolygonStamped,
    },
    ESTIMATOR: {topics.STATE: DiagnosticArray},
    CONTROLLER: {topics.CMD_VEL: TwistStamped},
}
_STANDING = Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)
_CAMERA = PinholeCamera(width_px=4, height_px=3, fx_px=4.0, fy_px=4.0, cx_px=1.5, cy_px=1.0)


def pose_at(tick: int) -> Pose2:
    """Return where the robot is at a tick: it drives 4 mm in each."""
    return Pose2(x_m=1.0 + 0.004 * tick, y_m=2.0, heading_rad=0.0)


def odometry_at(tick: int) -> Pose2:
    """Return where its encoders say that it is: they begin at zero."""
    return Pose2(x_m=0.004 * tick, y_m=0.0, heading_rad=0.0)


class ScriptedGraph:
    """The four nodes.

    Args:
        context: Where they live.
        compressed: Whether the robot publishes compressed images too.
    """

    def __init__(self, context: Context, *, compressed: bool = True) -> None:
        """Join the graph."""
        self._executor = SingleThreadedExecutor(context=context)
        self._nodes = {
            name: Node(name, context=context, enable_rosout=False, start_parameter_services=False)
            for name in _PUBLISHED
        }
        self._publishers: dict[str, Any] = {}
        for name, node in self._nodes.items():
            self._executor.add_node(node)
            for topic, message_type in _PUBLISHED[name].items():
                if compressed or topic != topics.COMPRESSED_IMAGE:
                    self._publishers[topic] = node.create_publisher(message_type, topic, DEEP_QOS)
        node = self._nodes[CONTROLLER]
        self._transitions = node.create_publisher(DiagnosticArray, topics.TRANSITION, DEEP_QOS)

    def publish_tick(self, tick: int, truth: Pose2 | None = None) -> None:
        """Publish all messages of a tick.

        Args:
            tick: Its number.
            truth: True pose of the robot; None for `pose_at`.
        """
        messages = _tick(tick, truth or pose_at(tick))
        for topic, publisher in self._publishers.items():
            publisher.publish(messages[topic])

    def publish_transition(self, tick: int, transition: Transition) -> None:
        """Publish a finished action with the stamp of a tick."""
        self._transitions.publish(transition_to_raw(transition, tick * PERIOD_NS))

    def spin_once(self) -> None:
        """Serve what is due."""
        self._executor.spin_once(timeout_sec=0.01)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        for node in self._nodes.values():
            node.destroy_node()


def _tick(tick: int, truth: Pose2) -> dict[str, Any]:
    """Return the messages of a tick by topic; one bumper is always pressed."""
    stamp_ns = tick * PERIOD_NS
    head = HeadAngles(turret_rad=0.01 * tick, pan_rad=0.0, tilt_rad=0.0)
    state = RegionState(
        region=(1, 1),
        mu_x=(0.25, 0.75, 0.0),
        mu_y=(0.0, 1.0, 0.0),
        pose=truth,
        goal_probability=1.0 / (tick + 1),
        confidence=Confidence.OK,
    )
    estimate = PoseEstimate(
        pose=Pose2(x_m=truth.x_m + 0.03, y_m=truth.y_m, heading_rad=0.1),
        covariance=np.diag((1e-4, 1e-4, 1e-4)),
    )
    led = LandmarkObservation(u_px=float(tick), v_px=1.0, peak_dn=200.0)
    image = np.full((3, 4), tick % 256, np.uint8)
    jpeg = CompressedImage(
        header=header(stamp_ns, topics.CAMERA_FRAME),
        format='jpeg',
        data=array('B', cv2.imencode('.jpg', image)[1].tobytes()),
    )
    pressed = [number == 4 for number in range(20)]
    return {
        topics.CLOCK: clock_to_raw(stamp_ns),
        topics.GROUND_TRUTH: odometry_to_raw(_standing(truth), stamp_ns, frame_id='map'),
        topics.ODOM: odometry_to_raw(_standing(odometry_at(tick)), stamp_ns, frame_id='odom'),
        topics.JOINT_STATES: head_to_raw(head, stamp_ns),
        topics.BUMPERS: bumpers_to_raw(pressed, stamp_ns, body_radius_m=0.2, scan_time_s=0.04),
        topics.CAMERA_INFO: camera_to_raw(_CAMERA, stamp_ns),
        topics.IMAGE: image_to_raw(image, stamp_ns),
        topics.COMPRESSED_IMAGE: jpeg,
        topics.POSE: estimate_to_raw(estimate, stamp_ns),
        topics.HEAD_COMMAND: head_to_raw(head, stamp_ns),
        topics.LANDMARKS: landmarks_to_raw([led, None, None], stamp_ns),
        topics.STATE: state_to_raw(state, stamp_ns),
        topics.CMD_VEL: twist_to_raw(_STANDING, stamp_ns),
    }


def _standing(pose: Pose2) -> Odometry:
    return Odometry(pose=pose, twist=_STANDING)
