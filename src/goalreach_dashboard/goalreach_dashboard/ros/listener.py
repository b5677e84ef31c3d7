"""Updates the live page's state from the topics of a graph."""

from collections import deque
from collections.abc import Callable
import math
import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, JointState, LaserScan
from std_msgs.msg import Float64MultiArray

from goalreach_dashboard.ros.subscriptions import CameraReader, PolledSubscription, best_effort
from goalreach_dashboard.state import PageState
from goalreach_msgs_py import topics
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.diagnostic_messages import (
    q_table_from_raw,
    state_from_raw,
    transition_from_raw,
)
from goalreach_msgs_py.pose_messages import estimate_from_raw, odometry_from_raw
from goalreach_msgs_py.ros.messaging import LATCHED_QOS
from goalreach_msgs_py.sensor_messages import (
    bumpers_from_raw,
    camera_from_raw,
    head_from_raw,
    landmarks_from_raw,
)
from goalreach_msgs_py.values import Transition

_BUMP_SHOWN_S: Final = 0.6
_TRUTH_TIMEOUT_S: Final = 0.5
"""Longest wait of a transition for the true pose of its stamp, which may arrive later. Chosen."""
_WATCHED: Final[dict[str, tuple[type[Any], int]]] = {
    topics.DIAGNOSTICS: (DiagnosticArray, 20),
    topics.CMD_VEL: (TwistStamped, 1),
    topics.STATE: (DiagnosticArray, 1),
    topics.POSE: (PoseWithCovarianceStamped, 5),
    topics.HEAD_COMMAND: (JointState, 1),
    topics.LANDMARKS: (PolygonStamped, 100),
    topics.GROUND_TRUTH: (Odometry, 100),
    topics.CLOCK: (Clock, 1),
    topics.ODOM: (Odometry, 1),
    topics.JOINT_STATES: (JointState, 1),
    topics.BUMPERS: (LaserScan, 20),
    topics.CAMERA_INFO: (CameraInfo, 1),
}
"""Types and queue lengths, in the order in which topics are taken: the truth after what is
compared with it."""


class GraphListener:
    """Updates the page's state from the topics of a graph.

    Subscribes: `/q_learning/transition` and `/q_learning/q_table` always, so that no path is
    missed; every other topic of the four nodes, except `/path`, only while the page is watched.

    Args:
        node: A node that no executor spins.
        state: The state to update.
    """

    def __init__(self, node: Node, state: PageState) -> None:
        self._node = node
        self._state = state
        self._transitions = PolledSubscription(
            node, DiagnosticArray, topics.TRANSITION, QoSProfile(depth=500)
        )
        self._q_table = PolledSubscription(node, Float64MultiArray, topics.Q_TABLE, LATCHED_QOS)
        self._watched: tuple[PolledSubscription, ...] = ()
        self._camera: CameraReader | None = None
        self._pending: deque[tuple[float, int, Transition]] = deque()
        self._bump_s = -math.inf
        # The truth comes first: estimates are compared with it by stamp.
        self._handlers: tuple[tuple[str, Callable[[bytes], None]], ...] = (
            (topics.GROUND_TRUTH, self._on_truth),
            (topics.CLOCK, self._setter('clock_ns', stamp_of)),
            (topics.ODOM, self._on_odometry),
            (topics.JOINT_STATES, self._setter('head', head_from_raw)),
            (topics.BUMPERS, self._on_bumpers),
            (topics.CAMERA_INFO, self._on_camera_info),
            (topics.STATE, self._setter('state', state_from_raw)),
            (topics.LANDMARKS, self._on_landmarks),
        )

    def watch(self, *, watched: bool) -> None:
        """Subscribe to what the page shows, or unsubscribe.

        Args:
            watched: Whether somebody watches the page.
        """
        if watched and self._camera is None:
            self._state.restart()
            self._camera = CameraReader(self._node)
            self._watched = tuple(
                PolledSubscription(self._node, message_type, topic, best_effort(depth))
                for topic, (message_type, depth) in _WATCHED.items()
            )
        elif not watched and self._camera is not None:
            self._camera.close()
            for subscription in self._watched:
                subscription.close()
            self._watched, self._camera = (), None

    def update(self) -> None:
        """Take what has arrived; messages that cannot be used are logged and skipped."""
        received = {each.topic: self._take(each) for each in self._watched}
        # Taken after the truth and added before it: a true pose that is dropped next still counts.
        for raw in self._take(self._transitions):
            self._guard(self._on_transition, raw)
        for raw in self._take(self._q_table):
            self._guard(self._on_q_table, raw)
        for topic, handler in self._handlers:
            for raw in received.get(topic, ()):
                self._guard(handler, raw)
        self._guard(self._on_poses, received.get(topics.POSE, []))
        for raw in received.get(topics.LANDMARKS, ())[-1:]:
            self._guard(self._setter('landmarks', landmarks_from_raw), raw)
        self._add_transitions(self._state.poses.truth_ns)
        if self._camera is not None:
            self._guard(self._read_image, self._camera)

    def _take(self, subscription: PolledSubscription) -> list[Any]:
        messages = subscription.take()
        if messages:
            self._record(subscription)
        return messages

    def _record(self, subscription: PolledSubscription) -> None:
        self._state.health.record_message(
            subscription.topic, time.monotonic(), subscription.number
        )

    def _guard(self, handler: Callable[[Any], None], message: object) -> None:
        try:
            handler(message)
        except MessageError as error:
            self._node.get_logger().warning(f'{error}', throttle_duration_sec=5.0)

    def _read_image(self, camera: CameraReader) -> None:
        self._state.picture = camera.read() or self._state.picture
        if camera.subscription.number:
            self._record(camera.subscription)

    def _setter(self, name: str, from_raw: Callable[[bytes], object]) -> Callable[[bytes], None]:
        """Return a handler that keeps what a message holds as an attribute of the state."""
        return lambda raw: setattr(self._state, name, from_raw(raw))

    def _on_truth(self, raw: bytes) -> None:
        """Add a true pose, and at once the transitions of its stamp: the next may be elsewhere."""
        stamp_ns = stamp_of(raw)
        pose = odometry_from_raw(raw).pose
        self._state.poses.add_truth(stamp_ns, pose)
        self._add_transitions(stamp_ns)

    def _add_transitions(self, truth_ns: int) -> None:
        """Add the transitions whose true pose has arrived, or has not come in time."""
        while self._pending:
            received_s, stamp_ns, transition = self._pending[0]
            timed_out = time.monotonic() - received_s >= _TRUTH_TIMEOUT_S
            if stamp_ns > truth_ns and not timed_out:
                return
            self._pending.popleft()
            self._state.add_transition(stamp_ns, transition)

    def _on_odometry(self, raw: bytes) -> None:
        self._state.poses.add_odometry(stamp_of(raw), odometry_from_raw(raw).pose)

    def _on_bumpers(self, raw: bytes) -> None:
        """Show a press for a moment: the next path may begin in the next tick."""
        pressed, now_s = bumpers_from_raw(raw), time.monotonic()
        if any(pressed):
            self._bump_s = now_s
        if any(pressed) or now_s - self._bump_s > _BUMP_SHOWN_S:
            self._state.bumpers = pressed

    def _on_camera_info(self, raw: bytes) -> None:
        camera = camera_from_raw(raw)
        self._state.fov_rad = 2.0 * math.atan(camera.width_px / 2.0 / camera.fx_px)

    def _on_landmarks(self, raw: bytes) -> None:
        if self._camera is not None:
            self._camera.add_landmarks(raw)

    def _on_poses(self, poses: list[bytes]) -> None:
        """Add the newest pose that can be compared with the truth, else the newest."""
        stamped = [(stamp_of(raw), raw) for raw in poses]
        compared = [each for each in stamped if self._state.poses.truth_at(each[0]) is not None]
        for stamp_ns, raw in (compared or stamped)[-1:]:
            self._state.add_estimate(stamp_ns, estimate_from_raw(raw))

    def _on_transition(self, raw: bytes) -> None:
        self._pending.append((time.monotonic(), stamp_of(raw), transition_from_raw(raw)))
        self._add_transitions(self._state.poses.truth_ns)

    def _on_q_table(self, raw: bytes) -> None:
        self._state.set_q_table(q_table_from_raw(raw))
