"""Gates that disturb the messages between the nodes of a live graph; and its observation."""

from collections.abc import Callable, Mapping
from functools import partial
import heapq
import itertools
import struct
import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
import numpy as np
from rcl_interfaces.msg import Log
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan

from goalreach_lab.faults.observer import StackObserver
from goalreach_msgs_py import topics
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.diagnostic_messages import state_from_raw, transition_from_raw
from goalreach_msgs_py.pose_messages import odometry_from_raw, twist_from_raw
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, SENSOR_QOS

PREFIX: Final = '/faulty'
_LINKS: Final = (
    (topics.IMAGE, Image, SENSOR_QOS, topics.LOCALIZER),
    (topics.CAMERA_INFO, CameraInfo, SENSOR_QOS, topics.LOCALIZER),
    (topics.JOINT_STATES, JointState, RELIABLE_QOS, topics.LOCALIZER),
    (topics.ODOM, Odometry, RELIABLE_QOS, topics.LOCALIZER),
    (topics.POSE, PoseWithCovarianceStamped, RELIABLE_QOS, topics.ESTIMATOR),
    (topics.STATE, DiagnosticArray, RELIABLE_QOS, topics.CONTROLLER),
    (topics.BUMPERS, LaserScan, RELIABLE_QOS, topics.CONTROLLER),
    (topics.CMD_VEL, TwistStamped, RELIABLE_QOS, topics.ROBOT),
    (topics.HEAD_COMMAND, JointState, RELIABLE_QOS, topics.ROBOT),
)
_DEEP_QOS: Final = QoSProfile(depth=200)
_ENCAPSULATION_BYTES: Final = 4
_IMAGE_HEAD_BYTES: Final = 100
"""More than the fields of an image before its pixels take."""

_NS_PER_S: Final = 1_000_000_000


def gate_rules() -> list[str]:
    """Return the remapping rules that put a gate before each input of each node."""
    return [f'{node}:{topic}:={PREFIX}{topic}' for topic, _, _, node in _LINKS]


class Gate:
    """Passes serialized messages on, or disturbs them.

    Args:
        rng: Draws the messages that are lost.

    Attributes:
        effect: 'late', 'lost', 'twice', 'order', 'shift', 'drift', 'cover' (images: black), or
            empty: they pass unchanged.
        amount: Delay in seconds, share that is lost, or shift of the stamps in seconds.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._held: bytes | None = None
        self._since_s: float | None = None
        self.effect = ''
        self.amount = 0.0

    def set(self, effect: str, amount: float) -> None:
        """Begin an effect, or end it with an empty text."""
        self.effect, self.amount = effect, amount
        self._held = self._since_s = None

    def arrive(self, data: bytes, now_s: float) -> list[tuple[float, bytes]]:
        """Return the messages to send, and when, for one that arrived.

        Args:
            data: The serialized message.
            now_s: The time now, seconds of any clock.
        """
        match self.effect:
            case 'late':
                return [(now_s + self.amount, data)]
            case 'lost':
                return [] if self._rng.random() < self.amount else [(now_s, data)]
            case 'twice':
                return [(now_s, data), (now_s, data)]
            case 'order':
                held, self._held = self._held, None if self._held is not None else data
                return [] if held is None else [(now_s, data), (now_s, held)]
            case 'shift' | 'drift':
                began_s = self._since_s = now_s if self._since_s is None else self._since_s
                times = 1.0 if self.effect == 'shift' else now_s - began_s
                return [(now_s, shift_stamp(data, times * self.amount))]
            case 'cover':
                data = data[:_IMAGE_HEAD_BYTES] + bytes(len(data) - _IMAGE_HEAD_BYTES)
        return [(now_s, data)]


def shift_stamp(data: bytes, shift_s: float) -> bytes:
    """Return a serialized message with the stamp of its header shifted; at least zero.

    Args:
        data: CDR of a message that begins with a header or a time.
        shift_s: Shift, s.
    """
    order = '<' if data[1] & 1 else '>'
    sec, nanosec = struct.unpack_from(f'{order}iI', data, _ENCAPSULATION_BYTES)
    stamp_ns = max(0, sec * _NS_PER_S + nanosec + round(shift_s * _NS_PER_S))
    changed = bytearray(data)
    struct.pack_into(
        f'{order}iI', changed, _ENCAPSULATION_BYTES, stamp_ns // _NS_PER_S, stamp_ns % _NS_PER_S
    )
    return bytes(changed)


class Gates:
    """One gate for each topic between two nodes.

    Args:
        node: The node that receives and sends the messages.
        speed: Seconds of the graph's clock in one of the wall clock.
        rng: Draws the messages that are lost.
    """

    def __init__(self, node: Node, *, speed: float, rng: np.random.Generator) -> None:
        """Open them all."""
        self._speed = speed
        self._order = itertools.count()
        self._waiting: list[tuple[float, int, Any, bytes]] = []
        self._gates: dict[str, Gate] = {}
        for topic, kind, qos, _ in _LINKS:
            self._gates[topic] = Gate(rng)
            outlet = node.create_publisher(kind, PREFIX + topic, qos)
            passing = self._passing(self._gates[topic], outlet)
            node.create_subscription(kind, topic, passing, qos, raw=True)

    def set(self, topic: str, effect: str = '', amount: float = 0.0) -> None:
        """Begin an effect at a gate, or end it."""
        self._gates[topic].set(effect, amount)

    def _passing(self, gate: Gate, outlet: Any) -> Callable[[bytes], None]:
        def arrive(data: bytes) -> None:
            now_s = time.monotonic() * self._speed
            for due_s, message in gate.arrive(data, now_s):
                if due_s <= now_s:
                    outlet.publish(message)
                else:
                    heapq.heappush(self._waiting, (due_s, next(self._order), outlet, message))

        return arrive

    def release(self) -> None:
        """Send the delayed messages that are due; call it often."""
        now_s = time.monotonic() * self._speed
        while self._waiting and self._waiting[0][0] <= now_s:
            _, _, outlet, message = heapq.heappop(self._waiting)
            outlet.publish(message)


def observe_graph(node: Node, observer: StackObserver, *, gated: bool) -> None:
    """Feed an observer with truth, state, commands and reports of the nodes.

    Args:
        node: The node that subscribes.
        observer: The observer.
        gated: Whether commands pass a gate before they reach the robot.
    """

    def on_truth(raw: bytes) -> None:
        observer.on_truth(stamp_of(raw), odometry_from_raw(raw), wall_s=time.monotonic())

    def on_dated_truth(raw: bytes, info: Mapping[str, int]) -> None:
        observer.sent_ns[stamp_of(raw)] = info['source_timestamp']
        on_truth(raw)

    def on_state(raw: bytes) -> None:
        observer.on_state(stamp_of(raw), state_from_raw(raw))

    def on_command(raw: bytes) -> None:
        try:
            observer.on_command(stamp_of(raw), twist_from_raw(raw))
        except MessageError as error:
            observer.lines.append(f'command: {error}')

    create = partial(node.create_subscription, raw=True)
    # EventsExecutor, which gates need for their speed, does not give the message info.
    create(Odometry, topics.GROUND_TRUTH, on_truth if gated else on_dated_truth, _DEEP_QOS)
    create(DiagnosticArray, topics.STATE, on_state, _DEEP_QOS)
    create(
        TwistStamped, PREFIX + topics.CMD_VEL if gated else topics.CMD_VEL, on_command, _DEEP_QOS
    )
    _observe_reports(node, observer)


def _observe_reports(node: Node, observer: StackObserver) -> None:
    def on_action(raw: bytes) -> None:
        observer.paths_ended += transition_from_raw(raw).outcome is not None

    def on_log(message: Log) -> None:
        observer.lines.append(f'{message.name}: {message.msg}')

    def on_diagnostics(message: DiagnosticArray) -> None:
        for status in message.status:
            if status.level != DiagnosticStatus.OK:
                values = ', '.join(f'{pair.key}: {pair.value}' for pair in status.values)
                observer.lines.append(f'{status.name}: {status.message} ({values})')

    create = node.create_subscription
    create(DiagnosticArray, topics.TRANSITION, on_action, _DEEP_QOS, raw=True)
    create(Log, '/rosout', on_log, _DEEP_QOS)
    create(DiagnosticArray, topics.DIAGNOSTICS, on_diagnostics, _DEEP_QOS)
