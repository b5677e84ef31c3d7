"""Listens to a robot for some seconds, moves it by small amounts, or drives it around a square."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import math
import statistics
import time
from typing import Any, Final, cast

from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped
import numpy as np
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from goalreach_bringup.robot_check import moves
from goalreach_bringup.robot_check.verdicts import End, HeardRobot, Verdict
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.steering import STANDING
from goalreach_msgs_py import topics
from goalreach_msgs_py.alignment import moved_on
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.pose_messages import estimate_from_raw, twist_to_raw
from goalreach_msgs_py.ros import messaging
from goalreach_msgs_py.ros.interfaces import message_class
from goalreach_msgs_py.ros.messaging import resolved_name, subscribe_raw
from goalreach_msgs_py.sensor_messages import head_to_raw, landmarks_from_raw
from goalreach_msgs_py.values import (
    FloatArray,
    HeadAngles,
    LandmarkObservation,
    Pose2,
    PoseEstimate,
    Twist2,
)
from goalreach_perception.calibration_model import DriveRecord
from goalreach_perception.landmark_localizer_node import LandmarkLocalizerNode
from goalreach_perception.localizer_config import LocalizerConfig

_DISCOVERY_S: Final = 1.0
_MOVE_S: Final = 1.0
_SETTLE_S: Final = 1.0
_LONGEST_S: Final = 10.0
_COMMAND_S: Final = 0.05
_IMAGES: Final = 5
"""Images of a measurement of LEDs. Chosen: few show a dark LED or a further light."""
_LATCHED: Final = 'latched'
_LEVEL: Final = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
_PAUSE_S, _SILENT_S = 0.3, 10.0
"""Time without a pose after which the robot stands, and after which the drive ends. Chosen."""
_SEARCH_S: Final = 60.0
"""Longest search for the pose: the head looks around twice. Chosen."""
_APART_M: Final = 0.4
"""Largest distance of images from odometry. Chosen."""
_LONGEST_NS: Final = 300_000_000_000
_STAND: Final = 25
"""Images of a robot that stands, before and after. Chosen."""


class RobotListener:
    """A node that subscribes to the inputs of our nodes, and can publish their commands."""

    def __init__(self, namespace: str, robot: HeardRobot) -> None:
        self._node = Node('check_robot', namespace=namespace, enable_rosout=False)
        self._robot = robot
        self._publishers: dict[str, Publisher[Any]] = {}
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)

    def listen(self, duration_s: float) -> None:
        """Listen for some time."""
        self._serve(_DISCOVERY_S)
        self._find_ends()
        for topic, heard in self._robot.inputs.items():
            qos = messaging.NEWEST_QOS if heard.kind.endswith('Image') else messaging.SAMPLES_QOS
            latched = any(_LATCHED in end.qos for end in heard.publishers)
            if latched and topic == topics.CAMERA_INFO:
                qos = messaging.LATCHED_QOS
            kind, name = message_class(heard.kind), resolved_name(self._node, topic)
            self._node.create_subscription(kind, name, heard.add, qos, raw=True)
        self._serve(duration_s)
        self._find_ends()
        node, space = self._node, self._node.get_namespace().rstrip('/')
        published = {t for t, _ in node.get_topic_names_and_types() if node.count_publishers(t)}
        services = {name for name, _ in node.get_service_names_and_types()}
        self._robot.topics, self._robot.services = (
            frozenset(name.removeprefix(space) for name in names if name.startswith(f'{space}/'))
            for names in (published, services)
        )

    def _find_ends(self) -> None:
        for topic, heard in {**self._robot.inputs, **self._robot.outputs}.items():
            name = resolved_name(self._node, topic)
            heard.publishers = self._ends(self._node.get_publishers_info_by_topic(name))
            heard.subscribers = self._ends(self._node.get_subscriptions_info_by_topic(name))

    def _ends(self, infos: list[TopicEndpointInfo]) -> tuple[End, ...]:
        own = self._node.get_name()
        return tuple(
            End(node=info.node_name, kind=info.topic_type, qos=_qos_words(info))
            for info in infos
            if info.node_name != own
        )

    def _serve(self, duration_s: float) -> None:
        until_s = time.monotonic() + duration_s
        while (left_s := until_s - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left_s)

    def _advertise(self, *names: str) -> None:
        create, qos = self._node.create_publisher, messaging.RELIABLE_QOS
        for topic in names:
            kind = message_class(self._robot.outputs[topic].kind)
            self._publishers[topic] = create(kind, resolved_name(self._node, topic), qos)

    def move(self) -> Iterator[Verdict]:
        """Turn each joint and back, drive ahead and turn; yield the verdicts."""
        self._advertise(*self._robot.outputs)
        for joint in self._robot.joints:
            before, name = self._measure(), joint.replace('_joint', '_rad')
            there = replace(before.head, **{name: getattr(before.head, name) + moves.TURN_RAD})
            self._command(there)
            yield from moves.judge_motion(joint, before, self._measure())
            self._command(before.head)
        ahead = Twist2(linear_m_per_s=moves.DRIVE_M / _MOVE_S, steering_rad_per_s=0.0)
        left = Twist2(linear_m_per_s=0.0, steering_rad_per_s=moves.TURN_RAD / _MOVE_S)
        for subject, twist in ((moves.DRIVE, ahead), (moves.TURN, left)):
            before = self._measure()
            try:
                self._command(twist)
            finally:
                self._command(STANDING)
            yield from moves.judge_motion(subject, before, self._measure())

    def _command(self, target: HeadAngles | Twist2) -> None:
        """Repeat a command, with the stamp of the last image, for a second of their clock."""
        stamps_s = self._robot.inputs[self._robot.image].stamps_s
        end_s, until_s = stamps_s[-1] + _MOVE_S - _COMMAND_S / 2, time.monotonic() + _LONGEST_S
        while stamps_s[-1] < end_s and time.monotonic() < until_s:
            self._send(target, round(stamps_s[-1] * 1e9))
            self._serve(_COMMAND_S)

    def _send(self, target: HeadAngles | Twist2, stamp_ns: int) -> None:
        """Send a command that answers an image."""
        robot = self._robot
        if isinstance(target, HeadAngles):
            raw = head_to_raw(target, stamp_ns, joints=robot.joints)
            self._publishers[topics.HEAD_COMMAND].publish(raw)
        else:
            raw = twist_to_raw(target, stamp_ns if robot.robot.stamped_cmd_vel else None)
            self._publishers[topics.CMD_VEL].publish(raw)

    def _measure(self) -> moves.Measurement:
        """Return joints, odometry and LEDs, once the robot stands, by the clock of its stamps."""
        inputs, until_s = self._robot.inputs, time.monotonic() + _LONGEST_S
        names = {topics.ODOM, topics.JOINT_STATES, self._robot.image} & set(inputs)
        needed = [inputs[name].stamps_s for name in names]
        settled_s = max(stamps_s[-1] for stamps_s in needed) + _SETTLE_S
        while min(stamps_s[-1] for stamps_s in needed) < settled_s and time.monotonic() < until_s:
            self._serve(_COMMAND_S)
        rays = [self._next_rays() for _ in range(_IMAGES)]  # an LED may be dark in one image
        usual = statistics.mode(map(len, rays))
        return moves.Measurement(
            head=inputs[topics.JOINT_STATES].last if self._robot.joints else _LEVEL,
            pose=inputs[topics.ODOM].last.pose,
            rays=next(one for one in rays if len(one) == usual),
        )

    def _next_rays(self) -> FloatArray:
        """Return the rays to the LEDs of the next image, as in `Measurement`."""
        heard, until_s = self._robot.inputs[self._robot.image], time.monotonic() + _SETTLE_S
        count = len(heard.stamps_s)
        while len(heard.stamps_s) == count and time.monotonic() < until_s:
            self._serve(_COMMAND_S)
        camera = self._robot.inputs[topics.CAMERA_INFO].last
        spots = LocalizerConfig().spot_detector().in_frame(heard.last)
        seen_px = spots.pixels_px[[row for row, is_led in enumerate(spots.led_like) if is_led]]
        return np.asarray((seen_px - (camera.cx_px, camera.cy_px)) / (camera.fx_px, camera.fy_px))


def _qos_words(info: TopicEndpointInfo) -> str:
    reliable = info.qos_profile.reliability is ReliabilityPolicy.RELIABLE
    latched = info.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    return ('reliable' if reliable else 'best effort') + f', {_LATCHED}' * latched


class CalibrationDrive(RobotListener):
    """A `landmark_localizer`, and a node that drives the robot by its odometry."""

    def __init__(self, namespace: str, robot: HeardRobot) -> None:
        super().__init__(namespace, robot)
        for topic in {topics.ODOM, topics.JOINT_STATES} & set(robot.inputs):
            robot.inputs[topic].kept = []
        self._advertise(topics.CMD_VEL)
        self._landmarks: dict[int, tuple[LandmarkObservation | None, ...]] = {}
        self._poses: dict[int, PoseEstimate] = {}

    def _localize(self) -> None:
        """Start the localizer, which also turns the head."""

        def hear_pose(stamp_ns: int, raw: bytes) -> None:
            self._poses[stamp_ns] = estimate_from_raw(raw)

        def hear_landmarks(stamp_ns: int, raw: bytes) -> None:
            self._landmarks[stamp_ns] = landmarks_from_raw(raw)

        node, qos = self._node, messaging.DEEP_QOS
        subscribe_raw(node, PoseWithCovarianceStamped, topics.POSE, hear_pose, qos)
        subscribe_raw(node, PolygonStamped, topics.LANDMARKS, hear_landmarks, qos)
        self._executor.add_node(LandmarkLocalizerNode())

    def _next(self, command: Twist2 = STANDING) -> PoseEstimate:
        """Send a command; return the next estimate. If it is late, the robot is stopped.

        Raises:
            GoalreachError: No estimate comes, or a bumper is pressed.
        """
        count, began_s = len(self._poses), time.monotonic()
        if self._poses:
            self._send(command, self._now_ns)
        while len(self._poses) == count:
            self._executor.spin_once(timeout_sec=_PAUSE_S)
            waited_s = time.monotonic() - began_s
            if waited_s > _SILENT_S:
                raise GoalreachError(f'no pose for {_SILENT_S:.0f} s: the robot is silent')
            if waited_s > _PAUSE_S and self._poses:
                self._send(STANDING, self._now_ns)
        if any(self._robot.inputs[topics.BUMPERS].last or ()):
            raise GoalreachError('a bumper is pressed')
        return self._poses[self._now_ns]

    @property
    def _now_ns(self) -> int:
        return next(reversed(self._poses))

    @property
    def _odometry(self) -> Pose2:
        return cast('Pose2', self._robot.inputs[topics.ODOM].last.pose)

    def drive(self, arena: Arena, side_m: float, config: ControllerConfig) -> DriveRecord:
        """Drive around a square; return what was measured.

        The robot stands at the end, whatever ends it.

        Raises:
            GoalreachError: The pose is not found, no square fits, a bumper is pressed, inputs
                fall silent, or images contradict the odometry.
        """
        self._localize()
        try:
            begin_ns, pose = self._find_pose()
            turns_rad = moves.plan_square(arena, pose, side_m, config.body_radius_m)
            self._follow(moves.SquareDrive(self._odometry, turns_rad, side_m, config), pose)
        finally:
            self._command(STANDING)
        return self._record(begin_ns)

    def _find_pose(self) -> tuple[int, Pose2]:
        """Stand until the pose has been known for a while; return since when, and the pose."""
        until_s, since = time.monotonic() + _SEARCH_S, list[int]()
        while len(since) < _STAND:
            estimate = self._next()
            since = [*since, self._now_ns] if moves.is_known(estimate) else []
            if time.monotonic() > until_s:
                raise GoalreachError('the pose is not found: let the robot face the landmarks')
        return since[0], estimate.pose

    def _follow(self, square: moves.SquareDrive, pose: Pose2) -> None:
        """Drive a square from a pose, and stand for a while."""
        begin, until_ns, stood = self._odometry, self._now_ns + _LONGEST_NS, 0
        command: Twist2 | None = STANDING
        while stood < _STAND:
            estimate = self._next(command or STANDING)
            at = moved_on(pose, begin, self._odometry)
            apart_m = math.hypot(at.x_m - estimate.pose.x_m, at.y_m - estimate.pose.y_m)
            if moves.is_known(estimate) and apart_m > _APART_M:
                line = f'images and odometry are {apart_m:.1f} m apart: check-robot --move'
                raise GoalreachError(line)
            if self._now_ns > until_ns:
                raise GoalreachError('the robot does not follow its commands: check-robot --move')
            command = square.command(self._odometry)
            stood += command is None

    def _record(self, begin_ns: int) -> DriveRecord:
        inputs, poses = self._robot.inputs, self._poses
        odometry = [(stamp_s, read.pose) for stamp_s, read in inputs[topics.ODOM].kept or ()]
        joints = inputs[topics.JOINT_STATES].kept if self._robot.joints else None
        sightings = [
            (stamp_ns * 1e-9, poses[stamp_ns].pose, landmarks)
            for stamp_ns, landmarks in sorted(self._landmarks.items())
            if stamp_ns >= begin_ns and stamp_ns in poses and moves.is_known(poses[stamp_ns])
            if any(landmarks)
        ]
        if len(sightings) < 2 * _STAND:
            raise GoalreachError(f'only {len(sightings)} images show landmarks')
        camera = inputs[topics.CAMERA_INFO].last
        return DriveRecord.collect(odometry, joints or (), sightings, camera)
