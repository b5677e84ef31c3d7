"""Nodes that say what those of a run say, with glimpses or without, as the test asks them to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry as OdometryMsg
import numpy as np
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan

from goalreach_msgs_py import topics
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.ros.learning_messages import transition_to_msg
from goalreach_msgs_py.ros.raw_camera import camera_to_raw, image_to_raw
from goalreach_msgs_py.ros.raw_estimates import estimate_to_raw, landmarks_to_raw, state_to_raw
from goalreach_msgs_py.ros.raw_robot import (
    bumpers_to_raw,
    clock_to_raw,
    head_to_raw,
    odometry_to_raw,
    twist_to_raw,
)
from goalreach_msgs_py.ros.stamped_reply import Outbox
from goalreach_msgs_py.ros.subscribe_raw import DEEP_QOS
from goalreach_msgs_py.ros.throttled import Glimpse
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
_SAID: dict[str, dict[str, type[Any]]] = {
    ROBOT: {
        topics.CLOCK: Clock,
        topics.GROUND_TRUTH: OdometryMsg,
        topics.ODOM: OdometryMsg,
        topics.JOINT_STATES: JointState,
        topics.BUMPERS: LaserScan,
        topics.CAMERA_INFO: CameraInfo,
        topics.IMAGE: Image,
    },
    LOCALIZER: {
        topics.POSE: PoseWithCovarianceStamped,
        topics.HEAD_COMMAND: JointState,
        topics.LANDMARKS: PolygonStamped,
    },
    ESTIMATOR: {topics.STATE: DiagnosticArray},
    CONTROLLER: {topics.CMD_VEL: TwistStamped},
}
_HISTORY = dict.fromkeys((topics.GROUND_TRUTH, topics.BUMPERS, topics.LANDMARKS), 100)
_HISTORY[topics.POSE] = 5
_STANDING = Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)
_CAMERA = PinholeCamera(width_px=4, height_px=3, fx_px=4.0, fy_px=4.0, cx_px=1.5, cy_px=1.0)


def pose_at(tick: int) -> Pose2:
    """Return where the robot is at a tick: it drives 4 mm in each."""
    return Pose2(x_m=1.0 + 0.004 * tick, y_m=2.0, heading_rad=0.0)


def odometry_at(tick: int) -> Pose2:
    """Return where its encoders say that it is: they begin at zero."""
    return Pose2(x_m=0.004 * tick, y_m=0.0, heading_rad=0.0)


class SpokenGraph:
    """The four nodes.

    Args:
        context: Where they live.
        glimpses: Whether they give glimpses.
        remaps: Remapping rules of ROS 2.
    """

    def __init__(self, context: Context, *, glimpses: bool, remaps: Sequence[str] = ()) -> None:
        """Join the graph."""
        rules = [word for rule in remaps for word in ('--remap', rule)]
        self._context = context
        self._executor = SingleThreadedExecutor(context=context)
        self._nodes = {
            name: Node(
                name,
                context=context,
                cli_args=['--ros-args', *rules] if rules else None,
                enable_rosout=False,
                start_parameter_services=False,
            )
            for name in _SAID
        }
        self._outboxes: dict[str, Outbox] = {}
        self._publishers: dict[str, Any] = {}
        for name, node in self._nodes.items():
            self._executor.add_node(node)
            if glimpses:
                picture = topics.IMAGE if name == ROBOT else None
                self._outboxes[name] = Outbox(Glimpse(node, history=_HISTORY, picture=picture))
            for topic, message_type in _SAID[name].items():
                self._publishers[topic] = node.create_publisher(message_type, topic, DEEP_QOS)
        node = self._nodes[CONTROLLER]
        self._actions = node.create_publisher(DiagnosticArray, topics.TRANSITION, DEEP_QOS)

    def say(self, tick: int, truth: Pose2 | None = None) -> None:
        """Say all of a tick.

        Args:
            tick: Its number.
            truth: Where the robot is; None for `pose_at`.
        """
        said = _tick(tick, truth or pose_at(tick))
        for name, topics_of in _SAID.items():
            messages = [(self._publishers[topic], said[topic]) for topic in topics_of]
            outbox = self._outboxes.get(name)
            if outbox is None:
                for publisher, message in messages:
                    publisher.publish(message)
                continue
            outbox.open(tick * PERIOD_NS)
            for publisher, message in messages:
                outbox.send(publisher, message)
            outbox.close()

    def relay(self, source: str, target: str) -> None:
        """Send on what is said on a topic, as somebody's filter does."""
        message_type = next(types[target] for types in _SAID.values() if target in types)
        node = Node('filter', context=self._context, enable_rosout=False)
        publisher = node.create_publisher(message_type, target, DEEP_QOS)
        node.create_subscription(message_type, source, publisher.publish, DEEP_QOS, raw=True)
        self._nodes[target] = node
        self._executor.add_node(node)

    def act(self, tick: int, transition: Transition) -> None:
        """Say that an action has ended."""
        self._actions.publish(transition_to_msg(transition, tick * PERIOD_NS))

    def serve(self) -> None:
        """Serve what is due."""
        self._executor.spin_once(timeout_sec=0.01)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        for node in self._nodes.values():
            node.destroy_node()


def _tick(tick: int, truth: Pose2) -> dict[str, bytes]:
    """Return what is said in a tick, by topic; one bumper is always pressed."""
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
    pressed = [number == 4 for number in range(20)]
    return {
        topics.CLOCK: clock_to_raw(stamp_ns),
        topics.GROUND_TRUTH: odometry_to_raw(_standing(truth), stamp_ns, frame_id='map'),
        topics.ODOM: odometry_to_raw(_standing(odometry_at(tick)), stamp_ns, frame_id='odom'),
        topics.JOINT_STATES: head_to_raw(head, stamp_ns),
        topics.BUMPERS: bumpers_to_raw(pressed, stamp_ns, body_radius_m=0.2, scan_time_s=0.04),
        topics.CAMERA_INFO: camera_to_raw(_CAMERA, stamp_ns),
        topics.IMAGE: image_to_raw(np.full((3, 4), tick % 256, np.uint8), stamp_ns),
        topics.POSE: estimate_to_raw(estimate, stamp_ns),
        topics.HEAD_COMMAND: head_to_raw(head, stamp_ns),
        topics.LANDMARKS: landmarks_to_raw([led, None, None], stamp_ns),
        topics.STATE: state_to_raw(state, stamp_ns),
        topics.CMD_VEL: twist_to_raw(_STANDING, stamp_ns),
    }


def _standing(pose: Pose2) -> Odometry:
    return Odometry(pose=pose, twist=_STANDING)
