"""Updates the live page's state from the topics of a graph, which it polls when it draws.

The page draws 20 frames a second, whatever the graph's rate. The middleware keeps the newest
messages of each topic: messages that are never shown are never deserialized, and rates are
computed from the publishers' sequence numbers.
"""

import base64
from collections import deque
from collections.abc import Callable
import math
import time
from typing import Any, Final

import cv2
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, LaserScan
from std_msgs.msg import Float64MultiArray, String
from visualization_msgs.msg import Marker, MarkerArray

from goalreach_dashboard.state import CameraPicture, Landmarks, PageState
from goalreach_msgs_py import diagnostic_messages as messages
from goalreach_msgs_py import image_messages, topics
from goalreach_msgs_py import sensor_messages as sensors
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.pose_messages import estimate_from_raw, odometry_from_raw
from goalreach_msgs_py.ros.messaging import LATCHED_QOS, RawReader
from goalreach_msgs_py.topics import CONTROLLER
from goalreach_msgs_py.values import Transition


def best_effort(depth: int) -> QoSProfile:
    """Return the profile of a subscription that keeps the newest messages and may lose some."""
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)


class PolledSubscription(RawReader):
    """A subscription of the page, whose newest messages alone matter.

    Attributes:
        topic: Name of the topic.
        number: Sequence number of the last message, as its publisher counts; where a topic has
            several publishers, the number of messages taken.
        is_shared: Whether it is the clock of all namespaces: the robot's has none of its own yet.
    """

    def __init__(self, node: Node, message_type: type[Any], topic: str, qos: QoSProfile) -> None:
        self.topic = topic
        self.number = 0
        self._taken = 0
        name = topic.removeprefix('/')
        is_clock = topic == topics.CLOCK and node.get_namespace() != '/'
        self.is_shared = is_clock and not node.count_publishers(name)
        super().__init__(node, message_type, topic if self.is_shared else name, qos)

    def take(self) -> list[bytes]:
        """Return the serialized messages received since the last call, oldest first."""
        messages: list[bytes] = []
        for message, info in self.received():
            messages.append(message)
            self.number = info['publication_sequence_number']
        self._taken += len(messages)
        if not self.number or self.count_publishers() > 1:
            self.number = self._taken
        return messages


_JPEG_QUALITY: Final = 70
_LANDMARK_STAMPS: Final = 128
_IMAGE_PERIOD_S: Final = 0.1
_IMAGE_TOLERANCE_S: Final = 0.03
"""Images arrive ten times a second; which 50 ms frame of the page finds one varies."""
_LANDMARK_TIMEOUT_S: Final = 0.5
"""Longest wait for the detections of an image. Chosen."""
_PNG_SIGNATURE: Final = b'\x89PNG'


def camera_picture(encoded: bytes, landmarks: Landmarks) -> CameraPicture:
    """Return an encoded image, JPEG or PNG, as the page shows it, with the LEDs detected in it.

    Raises:
        MessageError: OpenCV cannot decode the image.
    """
    height_px, width_px = image_messages.decode_image(encoded).shape
    kind = 'png' if encoded.startswith(_PNG_SIGNATURE) else 'jpeg'
    return CameraPicture(
        url=f'data:image/{kind};base64,{base64.b64encode(encoded).decode("ascii")}',
        width_px=width_px,
        height_px=height_px,
        landmarks=landmarks,
    )


class CameraReader:
    """Joins camera images with the landmarks detected in them, at most ten a second.

    Subscribes: `/camera/image_raw/compressed`; where nobody publishes that, as in a replayed bag,
    `/camera/image_raw`; from a node that no executor spins.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._landmarks: deque[tuple[int, Landmarks]] = deque(maxlen=_LANDMARK_STAMPS)
        self._image: bytes | None = None
        self._image_s = -math.inf
        self.subscription = self._subscribe(topics.COMPRESSED_IMAGE)

    def _subscribe(self, topic: str) -> PolledSubscription:
        message_type = CompressedImage if topic == topics.COMPRESSED_IMAGE else Image
        return PolledSubscription(self._node, message_type, topic, best_effort(1))

    def add_landmarks(self, stamp_ns: int, landmarks: Landmarks) -> None:
        """Keep detections until the image of their stamp arrives."""
        self._landmarks.append((stamp_ns, landmarks))

    def read(self) -> CameraPicture | None:
        """Return a new picture once its landmarks are known, or have not come in time.

        Raises:
            MessageError: The image cannot be used.
        """
        self._select_topic()
        now_s = time.monotonic()
        if self._image is None and now_s - self._image_s >= _IMAGE_PERIOD_S - _IMAGE_TOLERANCE_S:
            images = self.subscription.take()
            if images:
                self._image, self._image_s = images[-1], now_s
        raw = self._image
        if raw is None:
            return None
        landmarks = dict(self._landmarks).get(stamp_of(raw))
        if landmarks is None and now_s - self._image_s < _LANDMARK_TIMEOUT_S:
            return None
        self._image = None
        return camera_picture(self._encoded(raw), landmarks or ())

    def _select_topic(self) -> None:
        count = self._node.count_publishers
        image = topics.IMAGE.removeprefix('/')
        raw_only = count(image) and not count(f'{image}/compressed')
        topic = topics.IMAGE if raw_only else topics.COMPRESSED_IMAGE
        if topic != self.subscription.topic:
            self.close()
            self._image = None
            self.subscription = self._subscribe(topic)

    def _encoded(self, raw: bytes) -> bytes:
        if self.subscription.topic == topics.COMPRESSED_IMAGE:
            return image_messages.compressed_image_from_raw(raw)
        quality = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]
        return bytes(cv2.imencode('.jpg', image_messages.image_from_raw(raw), quality)[1])

    def close(self) -> None:
        """Unsubscribe."""
        self.subscription.close()


_BUMP_SHOWN_S: Final = 0.6
_TRUTH_TIMEOUT_S: Final = 0.5
"""Longest wait of a transition for the true pose of its stamp, which may arrive later. Chosen."""
_Handler = Callable[[bytes], None]


def _count_alone(_: bytes) -> None:
    """Do nothing with a message whose rate alone is shown, or that is handled with others."""


class GraphListener:
    """Updates the page's state from the topics of a graph, through a node that no executor spins.

    Subscribes: the topics of `/q_learning` always, so that no path is missed; every other topic of
    the four nodes, except `/path`, only while the page is watched.
    """

    def __init__(self, node: Node, state: PageState) -> None:
        self._node = node
        self._state = state
        self._watched: tuple[PolledSubscription, ...] = ()
        self._camera: CameraReader | None = None
        self._pending: deque[tuple[float, int, Transition]] = deque()
        self._bump_s = -math.inf
        self._twist: type[Any] = TwistStamped
        keep = self._setter
        self._always: dict[PolledSubscription, _Handler] = {
            PolledSubscription(node, message_type, topic, qos): handler
            for message_type, topic, qos, handler in (
                (DiagnosticArray, topics.TRANSITION, QoSProfile(depth=500), self._on_transition),
                (Float64MultiArray, topics.Q_TABLE, LATCHED_QOS, self._on_q_table),
                (String, topics.MODEL, LATCHED_QOS, keep('learner', messages.learner_from_raw)),
            )
        }
        # Type, topic, depth (0: latched) and handler. Taken from last to first, so the truth after
        # what is compared with it; handled from first to last, so the truth before that.
        self._inputs: tuple[tuple[type[Any], str, int, _Handler], ...] = (
            (Odometry, topics.GROUND_TRUTH, 100, self._on_truth),
            (Clock, topics.CLOCK, 1, keep('clock_ns', stamp_of)),
            (Odometry, topics.ODOM, 1, self._on_odometry),
            (JointState, topics.JOINT_STATES, 5, self._on_joints),
            (LaserScan, topics.BUMPERS, 20, self._on_bumpers),
            (CameraInfo, topics.CAMERA_INFO, 1, self._on_camera_info),
            (DiagnosticArray, topics.STATE, 1, keep('state', messages.state_from_raw)),
            (PolygonStamped, topics.LANDMARKS, 100, self._on_landmarks),
            (DiagnosticArray, topics.BEHAVIORS, 1, keep('behaviors', messages.statuses_from_raw)),
            (MarkerArray, topics.MARKERS, 0, self._on_markers),
            (PoseWithCovarianceStamped, topics.POSE, 5, _count_alone),
            (JointState, topics.HEAD_COMMAND, 1, _count_alone),
            (TwistStamped, topics.CMD_VEL, 1, _count_alone),
            (DiagnosticArray, topics.DIAGNOSTICS, 20, _count_alone),
        )

    def watch(self, *, watched: bool) -> None:
        """Subscribe to what the page shows while a browser is open, else unsubscribe."""
        if watched and self._camera is None:
            self._state.restart()
            self._camera = CameraReader(self._node)
            self._watched = tuple(
                PolledSubscription(
                    self._node,
                    self._twist if topic == topics.CMD_VEL else message_type,
                    topic,
                    best_effort(depth) if depth else LATCHED_QOS,
                )
                for message_type, topic, depth, _ in reversed(self._inputs)
            )
        elif not watched and self._camera is not None:
            self._camera.close()
            for subscription in self._watched:
                subscription.close()
            self._watched, self._camera = (), None

    def update(self) -> None:
        """Take what has arrived; messages that cannot be used are logged and skipped."""
        own_clock, controller = topics.CLOCK.removeprefix('/'), self._state.parameters[CONTROLLER]
        is_shared = any(each.is_shared for each in self._watched)
        twist = TwistStamped if controller.get('stamped_cmd_vel', True) else Twist
        if (is_shared and self._node.count_publishers(own_clock)) or twist is not self._twist:
            was_watched, self._twist = bool(self._watched), twist
            self.watch(watched=False)
            self.watch(watched=was_watched)
        received = {each.topic: self._take(each) for each in self._watched}
        # Taken after the truth and added before it: a true pose that is dropped next still counts.
        for subscription, handler in self._always.items():
            for raw in self._take(subscription):
                self._guard(handler, raw)
        self._add_transitions()
        for _, topic, _, handler in self._inputs:
            for raw in received.get(topic, ()):
                self._guard(handler, raw)
        self._guard(self._on_poses, received.get(topics.POSE, []))
        if self._camera is not None:
            self._guard(self._read_image, self._camera)

    def _take(self, subscription: PolledSubscription) -> list[Any]:
        if messages := subscription.take():
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
        self._state.poses.add_truth(stamp_of(raw), odometry_from_raw(raw).pose)
        self._add_transitions()

    def _add_transitions(self) -> None:
        """Add the transitions whose true pose has arrived, or has not come in time."""
        while self._pending:
            received_s, stamp_ns, transition = self._pending[0]
            timed_out = time.monotonic() - received_s >= _TRUTH_TIMEOUT_S
            if stamp_ns > self._state.poses.truth_ns and not timed_out:
                return
            self._pending.popleft()
            self._state.add_transition(stamp_ns, transition)

    def _on_odometry(self, raw: bytes) -> None:
        self._state.poses.add_odometry(stamp_of(raw), odometry_from_raw(raw).pose)

    def _on_joints(self, raw: bytes) -> None:
        """Keep the angles of the joints that the head has; some messages are of wheels alone."""
        names = sensors.joint_names_from_raw(raw)
        if joints := [name for name in topics.HEAD_JOINTS if name in names]:
            self._state.head = sensors.head_from_raw(raw, joints)

    def _on_bumpers(self, raw: bytes) -> None:
        """Show a press for a moment: the next path may begin in the next tick."""
        pressed, now_s = sensors.bumpers_from_raw(raw), time.monotonic()
        if any(pressed):
            self._bump_s = now_s
        if any(pressed) or now_s - self._bump_s > _BUMP_SHOWN_S:
            self._state.bumpers = pressed

    def _on_markers(self, raw: bytes) -> None:
        """Keep the obstacles: x, y, length, width (m), heading (rad), whether round."""
        obstacles = []
        for marker in deserialize_message(raw, MarkerArray).markers:
            at, size = marker.pose, marker.scale
            numbers = at.position.x, at.position.y, size.x, size.y
            heading_rad = 2.0 * math.atan2(at.orientation.z, at.orientation.w)
            if marker.ns == 'obstacles' and math.isfinite(sum(numbers) + heading_rad):
                rounded = (round(number_m, 3) for number_m in numbers)
                obstacles.append((*rounded, heading_rad, marker.type == Marker.CYLINDER))
        self._state.obstacles = obstacles

    def _on_camera_info(self, raw: bytes) -> None:
        camera = sensors.camera_from_raw(raw)
        self._state.fov_rad = 2.0 * math.atan(camera.width_px / 2.0 / camera.fx_px)

    def _on_landmarks(self, raw: bytes) -> None:
        self._state.landmarks = sensors.landmarks_from_raw(raw)
        if self._camera is not None:
            self._camera.add_landmarks(stamp_of(raw), self._state.landmarks)

    def _on_poses(self, poses: list[bytes]) -> None:
        """Add the newest pose that can be compared with the truth, else the newest."""
        stamped = [(stamp_of(raw), raw) for raw in poses]
        compared = [each for each in stamped if each[0] in self._state.poses.truths]
        for stamp_ns, raw in (compared or stamped)[-1:]:
            self._state.add_estimate(stamp_ns, estimate_from_raw(raw))

    def _on_transition(self, raw: bytes) -> None:
        self._pending.append((time.monotonic(), stamp_of(raw), messages.transition_from_raw(raw)))

    def _on_q_table(self, raw: bytes) -> None:
        self._state.set_q_table(messages.q_table_from_raw(raw))
