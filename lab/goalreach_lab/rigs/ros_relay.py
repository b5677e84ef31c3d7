"""The floor of latency: the messages of the graph, relayed by nodes that compute nothing.

    python -m goalreach_lab.rigs.ros_relay lockstep|realtime NODE ...

Messages are made once; callbacks only set a stamp and send.
"""

from collections.abc import Callable
from functools import partial
import sys
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry as OdometryMsg
import numpy as np
from rclpy.clock import Clock as RosClock
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan

from goalreach_msgs_py import topics
from goalreach_msgs_py.diagnostic_messages import state_to_raw
from goalreach_msgs_py.image_messages import image_to_raw
from goalreach_msgs_py.pose_messages import estimate_to_raw, odometry_to_raw, twist_to_raw
from goalreach_msgs_py.ros.messaging import (
    DEEP_QOS,
    RELIABLE_QOS,
    SENSOR_QOS,
    stamp_from_msg,
    stamp_to_msg,
)
from goalreach_msgs_py.ros.node import run_nodes
from goalreach_msgs_py.sensor_messages import (
    bumpers_to_raw,
    camera_to_raw,
    clock_to_raw,
    head_to_raw,
    landmarks_to_raw,
)
from goalreach_msgs_py.values import (
    Confidence,
    HeadAngles,
    Odometry,
    Pose2,
    PoseEstimate,
    RegionState,
    Twist2,
)
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig

_PERIOD_NS: Final = 40_000_000
_POLL_S: Final = 0.1
_SILENT_POLLS: Final = 10
_POSE: Final = Pose2(x_m=1.0, y_m=2.0, heading_rad=0.5)
_TWIST: Final = Twist2(linear_m_per_s=0.25, steering_rad_per_s=0.1)
_HEAD: Final = HeadAngles(turret_rad=0.1, pan_rad=0.2, tilt_rad=0.3)


class _Relay(Node):
    """A node that answers a message of one topic with prepared messages."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._out: list[tuple[Any, Any]] = []

    def add_output(self, topic: str, kind: type[Any], raw: bytes, qos: Any = RELIABLE_QOS) -> None:
        """Add a message to every answer, as an object."""
        message = deserialize_message(raw, kind)
        self._out.append((self.create_publisher(kind, topic, qos), message))

    def subscribe(
        self,
        topic: str,
        kind: type[Any],
        then: Callable[[int], None] = lambda _: None,
        qos: Any = RELIABLE_QOS,
    ) -> None:
        """Subscribe; by default, messages are ignored."""
        self.create_subscription(kind, topic, partial(_call, then), qos)

    def answer(self, stamp_ns: int) -> None:
        """Send all prepared messages with a stamp."""
        stamp = stamp_to_msg(stamp_ns)
        for publisher, message in self._out:
            if isinstance(message, Clock):
                message.clock = stamp
            else:
                message.header.stamp = stamp
            publisher.publish(message)


def _call(then: Callable[[int], None], message: Any) -> None:
    header = getattr(message, 'header', None)
    then(0 if header is None else stamp_from_msg(header.stamp))


class _Robot(_Relay):
    """Sends a frame when the last one was answered, or 25 times a second."""

    def __init__(self, *, lockstep: bool) -> None:
        super().__init__('nomad200')
        frame = Simulator(SimulatorConfig(), np.random.default_rng(0)).sense()
        odometry = Odometry(pose=_POSE, twist=_TWIST)
        self.add_output(topics.CLOCK, Clock, clock_to_raw(0))
        self.add_output(
            topics.GROUND_TRUTH,
            OdometryMsg,
            odometry_to_raw(odometry, 0, frame_id='map'),
            DEEP_QOS,
        )
        self.add_output(topics.ODOM, OdometryMsg, odometry_to_raw(odometry, 0, frame_id='odom'))
        self.add_output(topics.JOINT_STATES, JointState, head_to_raw(_HEAD, 0))
        bumpers = bumpers_to_raw(frame.bumpers, 0, body_radius_m=0.2, scan_time_s=0.04)
        self.add_output(topics.BUMPERS, LaserScan, bumpers)
        self.add_output(topics.CAMERA_INFO, CameraInfo, camera_to_raw(frame.camera, 0), SENSOR_QOS)
        self.add_output(topics.IMAGE, Image, image_to_raw(frame.image, 0), SENSOR_QOS)
        self._missing: set[str] = set()
        self._stamp_ns = 0
        self._polls = 0
        self._lockstep = lockstep
        for topic, kind in ((topics.CMD_VEL, TwistStamped), (topics.HEAD_COMMAND, JointState)):
            self.subscribe(topic, kind, partial(self._answered, topic))
        steady = RosClock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_POLL_S if lockstep else _PERIOD_NS * 1e-9, self._poll, clock=steady)

    def _answered(self, topic: str, stamp_ns: int) -> None:
        if self._lockstep and stamp_ns == self._stamp_ns and topic in self._missing:
            self._missing.discard(topic)
            if not self._missing:
                self._tick()

    def _tick(self) -> None:
        self._polls = 0
        self._missing = {topics.CMD_VEL, topics.HEAD_COMMAND}
        self._stamp_ns += _PERIOD_NS
        self.answer(self._stamp_ns)

    def _poll(self) -> None:
        """Tick by the clock; in lockstep only after a second without an answer."""
        self._polls += 1
        if not self._lockstep or self._polls >= _SILENT_POLLS:
            self._tick()


def _localizer() -> _Relay:
    node = _Relay('landmark_localizer')
    node.add_output(
        topics.POSE,
        PoseWithCovarianceStamped,
        estimate_to_raw(PoseEstimate(pose=_POSE, covariance=np.eye(3)), 0),
    )
    node.add_output(topics.HEAD_COMMAND, JointState, head_to_raw(_HEAD, 0))
    node.add_output(topics.LANDMARKS, PolygonStamped, landmarks_to_raw([None] * 3, 0))
    node.subscribe(topics.CAMERA_INFO, CameraInfo, qos=SENSOR_QOS)
    node.subscribe(topics.JOINT_STATES, JointState)
    node.subscribe(topics.ODOM, OdometryMsg)
    node.subscribe(topics.IMAGE, Image, node.answer, SENSOR_QOS)
    return node


def _estimator() -> _Relay:
    node = _Relay('state_estimator')
    state = RegionState(
        region=(1, 1),
        mu_x=(0.0, 0.875, 0.125),
        mu_y=(0.0, 0.6180339887498949, 0.3819660112501051),
        pose=_POSE,
        goal_probability=1.4142135623730951e-5,
        confidence=Confidence.OK,
    )
    node.add_output(topics.STATE, DiagnosticArray, state_to_raw(state, 0), DEEP_QOS)
    node.subscribe(topics.CLOCK, Clock)
    node.subscribe(topics.POSE, PoseWithCovarianceStamped, node.answer)
    return node


def _controller() -> _Relay:
    node = _Relay('goal_reaching_controller')
    node.add_output(topics.CMD_VEL, TwistStamped, twist_to_raw(_TWIST, 0))
    node.subscribe(topics.BUMPERS, LaserScan)
    node.subscribe(topics.STATE, DiagnosticArray, node.answer)
    return node


RELAYS: Final[dict[str, Callable[[], Node]]] = {
    'landmark_localizer': _localizer,
    'state_estimator': _estimator,
    'goal_reaching_controller': _controller,
}


def main() -> None:
    """Relay until SIGINT or SIGTERM."""
    kind, *names = sys.argv[1:]
    robot = partial(_Robot, lockstep=kind == 'lockstep')
    makers = [robot if name == 'nomad200' else RELAYS[name] for name in names]
    raise SystemExit(run_nodes('relay', makers, arguments=[sys.argv[0]]))


if __name__ == '__main__':
    main()
