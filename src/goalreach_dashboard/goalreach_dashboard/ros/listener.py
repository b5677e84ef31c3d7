"""Fills the page's state from the topics of a graph."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import math
import time
from typing import Final

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, JointState, LaserScan
from std_msgs.msg import Float64MultiArray

from goalreach_dashboard.ros.camera import CameraLook, landmarks_from_raw
from goalreach_dashboard.ros.taps import NodeTap, Source, Tap
from goalreach_dashboard.state import PageState
from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.ros.common_messages import MessageError, stamp_from_msg
from goalreach_msgs_py.ros.learning_messages import q_table_from_msg, transition_from_msg
from goalreach_msgs_py.ros.raw_camera import camera_from_raw
from goalreach_msgs_py.ros.raw_estimates import estimate_from_raw, state_from_raw
from goalreach_msgs_py.ros.raw_robot import bumpers_from_raw, head_from_raw, odometry_from_raw
from goalreach_msgs_py.topics import (
    BUMPERS,
    CAMERA_INFO,
    CLOCK,
    CMD_VEL,
    CONTROLLER,
    DIAGNOSTICS,
    ESTIMATOR,
    GROUND_TRUTH,
    HEAD_COMMAND,
    IMAGE,
    JOINT_STATES,
    LANDMARKS,
    LOCALIZER,
    MAP_FRAME,
    ODOM,
    POSE,
    Q_TABLE,
    ROBOT,
    STATE,
    TRANSITION,
)
from goalreach_msgs_py.values import Transition

_BUMP_SHOWN_S: Final = 0.6
_TRUTH_PATIENCE_S: Final = 0.5
"""How long an action waits for the truth of its stamp, which may come after it. Chosen."""
_SOURCES: Final = {
    CONTROLLER: (Source(TwistStamped, CMD_VEL),),
    ESTIMATOR: (Source(DiagnosticArray, STATE),),
    LOCALIZER: (
        Source(PoseWithCovarianceStamped, POSE, depth=5),
        Source(JointState, HEAD_COMMAND),
        Source(PolygonStamped, LANDMARKS, depth=50),
    ),
    ROBOT: (
        Source(Odometry, GROUND_TRUTH, depth=100),
        Source(Clock, CLOCK),
        Source(Odometry, ODOM),
        Source(JointState, JOINT_STATES),
        Source(LaserScan, BUMPERS, depth=20),
        Source(CameraInfo, CAMERA_INFO),
    ),
}
"""By node. The robot is listened to last: so the truth is there of what the others estimate."""


class Listener:
    """Takes what the nodes say and puts it into the state.

    Args:
        node: A node that is on no executor.
        state: Where it goes.
    """

    def __init__(self, node: Node, state: PageState) -> None:
        """Subscribe to all but the image, which costs most and is wanted only on open pages."""
        self._node = node
        self._state = state
        note = self._note
        self._nodes = {
            name: NodeTap(node, name, sources, told=(IMAGE,), note=note)
            for name, sources in _SOURCES.items()
        }
        self._camera = CameraLook(node, note)
        self._transitions = Tap(
            node, DiagnosticArray, TRANSITION, note=note, depth=500, reliable=True
        )
        self._q_table = Tap(node, Float64MultiArray, Q_TABLE, note=note, latched=True)
        self._diagnostics = Tap(node, DiagnosticArray, DIAGNOSTICS, note=note, depth=20, raw=True)
        self._actions: deque[tuple[float, int, Transition]] = deque()
        self._bump_s = -math.inf
        # Truth goes first: the others are compared with it by their stamps.
        self._puts: tuple[tuple[str, Callable[[bytes], None]], ...] = (
            (GROUND_TRUTH, self._on_truth),
            (CLOCK, self._on_clock),
            (ODOM, self._on_odometry),
            (JOINT_STATES, self._on_joints),
            (BUMPERS, self._on_bumpers),
            (CAMERA_INFO, self._on_camera),
            (STATE, self._on_state),
            (LANDMARKS, self._camera.detected),
        )

    def _note(self, topic: str, number: int) -> None:
        self._state.health.hear(topic, time.monotonic(), number)

    def listen(self, *, with_image: bool) -> None:
        """Take what has come; a message that cannot be used is passed over.

        Args:
            with_image: Whether somebody looks at the camera's image.
        """
        heard: dict[str, list[bytes]] = {}
        for tap in self._nodes.values():
            heard.update(tap.take())
        # Actions are taken after the truth and added before it: a place given up is still known.
        for message in self._transitions.take():
            self._put(self._on_action, message)
        for message in self._q_table.take():
            self._put(self._on_q_table, message)
        self._diagnostics.take()
        for topic, put in self._puts:
            for raw in heard.get(topic, ()):
                self._put(put, raw)
        self._put(self._on_poses, heard.get(POSE, []))
        for raw in heard.get(LANDMARKS, ())[-1:]:
            self._put(self._on_landmarks, raw)
        self._add_actions(self._state.robot.truth_ns)
        self._put(self._look, watched=with_image)

    def _put(self, put: Callable[..., None], *message: object, **how: bool) -> None:
        try:
            put(*message, **how)
        except MessageError as error:
            self._node.get_logger().warning(f'{error}', throttle_duration_sec=5.0)

    def _look(self, *, watched: bool) -> None:
        glimpsed = self._nodes[ROBOT].covers(IMAGE)
        picture = self._camera.look(watched=watched, glimpsed=glimpsed)
        if picture is not None:
            self._state.picture = picture

    def _on_clock(self, raw: bytes) -> None:
        self._state.clock_ns = _stamp_ns(raw)

    def _on_truth(self, raw: bytes) -> None:
        """Take a true pose, and at once the actions of its stamp: the next may be elsewhere."""
        stamp_ns = _stamp_ns(raw)
        self._state.robot.add_truth(stamp_ns, odometry_from_raw(raw, frame_id=MAP_FRAME).pose)
        self._add_actions(stamp_ns)

    def _add_actions(self, truth_ns: int) -> None:
        """Add the actions whose truth is there, or did not come."""
        while self._actions:
            heard_s, stamp_ns, transition = self._actions[0]
            waited = time.monotonic() - heard_s >= _TRUTH_PATIENCE_S
            if stamp_ns > truth_ns and not waited:
                return
            self._actions.popleft()
            self._state.add_transition(stamp_ns, transition)

    def _on_odometry(self, raw: bytes) -> None:
        self._state.robot.add_odometry(_stamp_ns(raw), odometry_from_raw(raw).pose)

    def _on_joints(self, raw: bytes) -> None:
        self._state.robot.head = head_from_raw(raw)

    def _on_bumpers(self, raw: bytes) -> None:
        """A press stays on the picture for a moment: the next path may begin in the next tick."""
        pressed, now_s = bumpers_from_raw(raw), time.monotonic()
        if any(pressed):
            self._bump_s = now_s
            self._state.robot.bumpers = pressed
        elif now_s - self._bump_s > _BUMP_SHOWN_S:
            self._state.robot.bumpers = pressed

    def _on_camera(self, raw: bytes) -> None:
        camera = camera_from_raw(raw)
        self._state.fov_rad = 2.0 * math.atan(camera.width_px / 2.0 / camera.fx_px)

    def _on_state(self, raw: bytes) -> None:
        self._state.state = state_from_raw(raw)

    def _on_poses(self, poses: list[bytes]) -> None:
        """Take the newest pose that can be compared with the truth, else the newest."""
        stamps_ns = [_stamp_ns(raw) for raw in poses]
        compared = [at for at in stamps_ns if self._state.robot.truth_at(at) is not None]
        for raw, stamp_ns in zip(poses, stamps_ns, strict=True):
            if stamp_ns == (compared or stamps_ns)[-1]:
                self._state.add_estimate(stamp_ns, estimate_from_raw(raw))

    def _on_landmarks(self, raw: bytes) -> None:
        self._state.landmarks = landmarks_from_raw(raw)

    def _on_action(self, message: DiagnosticArray) -> None:
        stamp_ns = stamp_from_msg(message.header.stamp)
        self._actions.append((time.monotonic(), stamp_ns, transition_from_msg(message)))
        self._add_actions(self._state.robot.truth_ns)

    def _on_q_table(self, message: Float64MultiArray) -> None:
        self._state.set_q_table(q_table_from_msg(message))


def _stamp_ns(raw: bytes) -> int:
    """Return the stamp of a message.

    Raises:
        MessageError: It is too short to have one.
    """
    stamp_ns = stamp_of(raw)
    if stamp_ns is None:
        raise MessageError(f'a message of {len(raw)} bytes')
    return stamp_ns
