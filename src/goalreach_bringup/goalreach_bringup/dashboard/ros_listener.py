"""Fills the page's state from the topics of a graph."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
import math
import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan
from std_msgs.msg import Float64MultiArray

from goalreach_bringup.dashboard.page_state import CameraPicture, PageState
from goalreach_bringup.dashboard.picture import data_url
from goalreach_bringup.dashboard.ros_taps import Tap
from goalreach_msgs_py.ros_common_messages import MessageError, stamp_from_msg
from goalreach_msgs_py.ros_estimate_messages import (
    estimate_from_msg,
    landmarks_from_msg,
    state_from_msg,
)
from goalreach_msgs_py.ros_learning_messages import q_table_from_msg, transition_from_msg
from goalreach_msgs_py.ros_sensor_messages import (
    bumpers_from_msg,
    camera_from_msg,
    head_from_msg,
    image_from_msg,
    odometry_from_msg,
)
from goalreach_msgs_py.topics import (
    BUMPERS,
    CAMERA_INFO,
    CLOCK,
    CMD_VEL,
    DIAGNOSTICS,
    GROUND_TRUTH,
    HEAD_COMMAND,
    IMAGE,
    JOINT_STATES,
    LANDMARKS,
    ODOM,
    PATH,
    POSE,
    Q_TABLE,
    STATE,
    TRANSITION,
)
from goalreach_msgs_py.values import LandmarkObservation

__all__ = ['Listener']

_STAMPS: Final = 128
_IMAGE_PERIOD_S: Final = 0.1
_IMAGE_PATIENCE_S: Final = 0.5
_BUMP_SHOWN_S: Final = 0.6

Landmarks = tuple[LandmarkObservation | None, ...]


class Listener:
    """Takes what the topics hold and puts it into the state.

    Args:
        node: A node that is on no executor.
        state: Where it goes.
    """

    def __init__(self, node: Node, state: PageState) -> None:
        """Subscribe to all but the image, which costs most and is wanted only on open pages."""
        self._node = node
        self._state = state
        self._landmarks: OrderedDict[int, Landmarks] = OrderedDict()
        self._image: Image | None = None
        self._image_s = -math.inf
        self._image_tap: Tap | None = None
        self._bump_s = -math.inf
        # Truth goes first: the others are compared with it by their stamps.
        self._taps: tuple[tuple[Tap, Callable[[Any], None]], ...] = (
            self._tap(Odometry, GROUND_TRUTH, self._on_truth, depth=100),
            self._tap(Clock, CLOCK, self._on_clock),
            self._tap(Odometry, ODOM, self._on_odometry),
            self._tap(JointState, JOINT_STATES, self._on_joints),
            self._tap(LaserScan, BUMPERS, self._on_bumpers, depth=20),
            self._tap(CameraInfo, CAMERA_INFO, self._on_camera),
            self._tap(DiagnosticArray, STATE, self._on_state),
            self._tap(PoseWithCovarianceStamped, POSE, self._on_pose),
            self._tap(PolygonStamped, LANDMARKS, self._on_landmarks, depth=50),
            self._tap(DiagnosticArray, TRANSITION, self._on_action, depth=500, reliable=True),
            self._tap(Float64MultiArray, Q_TABLE, self._on_q_table, latched=True),
            self._tap(TwistStamped, CMD_VEL, _ignore, raw=True),
            self._tap(JointState, HEAD_COMMAND, _ignore, raw=True),
            self._tap(Path, PATH, _ignore, raw=True),
            self._tap(DiagnosticArray, DIAGNOSTICS, _ignore, raw=True, depth=20),
        )

    def _tap(
        self, message_type: type[Any], topic: str, put: Callable[[Any], None], **how: Any
    ) -> tuple[Tap, Callable[[Any], None]]:
        return Tap(self._node, message_type, topic, note=self._note, **how), put

    def _note(self, topic: str, number: int) -> None:
        self._state.health.hear(topic, time.monotonic(), number)

    def listen(self, *, with_image: bool) -> None:
        """Take what has come; a message that cannot be used is passed over.

        Args:
            with_image: Whether somebody looks at the camera's image.
        """
        for tap, put in self._taps:
            for message in tap.take():
                self._put(put, message)
        self._look(with_image=with_image)

    def _put(self, put: Callable[[Any], None], message: object) -> None:
        try:
            put(message)
        except MessageError as error:
            self._node.get_logger().warning(f'{error}', throttle_duration_sec=5.0)

    def _look(self, *, with_image: bool) -> None:
        """Show an image together with what was detected in it, ten times a second at most."""
        if not with_image:
            if self._image_tap is not None:
                self._image_tap.close()
                self._image_tap = self._image = None
            return
        if self._image_tap is None:
            self._image_tap = Tap(self._node, Image, IMAGE, note=self._note)
        now_s = time.monotonic()
        if self._image is None and now_s - self._image_s >= _IMAGE_PERIOD_S:
            taken = self._image_tap.take()
            if taken:
                self._image, self._image_s = taken[-1], now_s
        if self._image is None:
            return
        stamp_ns = stamp_from_msg(self._image.header.stamp)
        landmarks = self._landmarks.get(stamp_ns)
        if landmarks is None and now_s - self._image_s < _IMAGE_PATIENCE_S:
            return
        self._show(self._image, stamp_ns, landmarks or ())
        self._image = None

    def _show(self, message: Image, stamp_ns: int, landmarks: Landmarks) -> None:
        try:
            image = image_from_msg(message)
        except MessageError as error:
            self._node.get_logger().warning(f'{error}', throttle_duration_sec=5.0)
            return
        height_px, width_px = image.shape
        self._state.picture = CameraPicture(
            url=data_url(image),
            width_px=width_px,
            height_px=height_px,
            landmarks=landmarks,
            stamp_ns=stamp_ns,
        )

    def _on_clock(self, message: Clock) -> None:
        self._state.clock_ns = stamp_from_msg(message.clock)

    def _on_truth(self, message: Odometry) -> None:
        stamp_ns = stamp_from_msg(message.header.stamp)
        self._state.robot.add_truth(stamp_ns, odometry_from_msg(message).pose)

    def _on_odometry(self, message: Odometry) -> None:
        stamp_ns = stamp_from_msg(message.header.stamp)
        self._state.robot.add_odometry(stamp_ns, odometry_from_msg(message).pose)

    def _on_joints(self, message: JointState) -> None:
        self._state.robot.head = head_from_msg(message)

    def _on_bumpers(self, message: LaserScan) -> None:
        """A press stays on the picture for a moment: the next path may begin in the next tick."""
        pressed, now_s = bumpers_from_msg(message), time.monotonic()
        if any(pressed):
            self._bump_s = now_s
            self._state.robot.bumpers = pressed
        elif now_s - self._bump_s > _BUMP_SHOWN_S:
            self._state.robot.bumpers = pressed

    def _on_camera(self, message: CameraInfo) -> None:
        camera = camera_from_msg(message)
        self._state.fov_rad = 2.0 * math.atan(camera.width_px / 2.0 / camera.fx_px)

    def _on_state(self, message: DiagnosticArray) -> None:
        self._state.state = state_from_msg(message)

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        stamp_ns = stamp_from_msg(message.header.stamp)
        self._state.add_estimate(stamp_ns, estimate_from_msg(message))

    def _on_landmarks(self, message: PolygonStamped) -> None:
        landmarks = landmarks_from_msg(message)
        self._state.landmarks = landmarks
        self._landmarks[stamp_from_msg(message.header.stamp)] = landmarks
        while len(self._landmarks) > _STAMPS:
            self._landmarks.popitem(last=False)

    def _on_action(self, message: DiagnosticArray) -> None:
        stamp_ns = stamp_from_msg(message.header.stamp)
        self._state.add_transition(stamp_ns, transition_from_msg(message))

    def _on_q_table(self, message: Float64MultiArray) -> None:
        self._state.set_q_table(q_table_from_msg(message))


def _ignore(_message: object) -> None:
    """Take a message that only counts."""
