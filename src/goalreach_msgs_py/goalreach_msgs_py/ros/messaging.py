"""How nodes publish and subscribe: quality of service, subscriptions, replies, bad inputs, stamps.

A node publishes a value as `publisher.publish(x_to_raw(value, stamp_ns))`, or as part of a
`StampedReply`, and receives it from `subscribe_raw` for `x_from_raw`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import time
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.timer import Timer
from std_msgs.msg import Header

from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.inputs import InputMonitor, InputProblem

SENSOR_QOS = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
"""ROS 2's sensor data profile: an old image is worth nothing (REP-2003)."""

NEWEST_QOS = QoSProfile(depth=2, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For readers of images. After a pause only the newest counts, and DDS keeps the buffer of a whole
image for each place of the queue that was ever full. With one place a hundredth of the images is
lost in real time, with two hardly any."""

RELIABLE_QOS = QoSProfile(depth=10)
"""States, commands and events."""

DEEP_QOS = QoSProfile(depth=200)
"""What is judged and counted: a subscriber that is 200 ticks late still misses none."""

LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""What a late subscriber still needs: markers, Q-table."""

_NS_PER_S = 1_000_000_000
_THROTTLE_S = 5.0
_CHECK_S = 0.2
_LOG_PERIOD_S = 2.0


def subscribe_raw(
    node: Node,
    message_type: type[Any],
    topic: str,
    callback: Callable[[int, bytes], None],
    qos: QoSProfile,
) -> None:
    """Subscribe to serialized messages that begin with a stamp.

    Args:
        node: The node that subscribes.
        message_type: Type of the messages.
        topic: Name of the topic.
        callback: Called with the stamp, nanoseconds, and the message. A `MessageError` that it
            raises is logged, and the message dropped.
        qos: Quality of service.
    """

    def receive(raw: bytes) -> None:
        try:
            callback(stamp_of(raw), raw)
        except MessageError as error:
            line = f'{topic}: {error}'
            node.get_logger().error(line, throttle_duration_sec=_THROTTLE_S)

    node.create_subscription(message_type, topic, receive, qos, raw=True)


def steady_timer(node: Node, period_s: float, callback: Callable[[], None]) -> Timer:
    """Create a timer that follows the wall clock, whatever the clock of the graph."""
    return node.create_timer(period_s, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))


class InputReporter:
    """Logs what an `InputMonitor` finds wrong with a node's inputs, each problem once in 2 s.

    Args:
        node: The node, whose executor runs the checks.
        required: The inputs that are reported when they never come.
        missing: How often each input has been missing, counted by a synchronizer; or None.
    """

    def __init__(
        self, node: Node, required: Iterable[str] = (), missing: Mapping[str, int] | None = None
    ) -> None:
        self._node = node
        self._monitor = InputMonitor(required)
        self._missing = missing
        self._logged_s: dict[tuple[str, str], float] = {}
        steady_timer(node, _CHECK_S, self._check)

    def received(self, topic: str, stamp_ns: int) -> None:
        """Record a message."""
        problem = self._monitor.received(topic, stamp_ns, time.monotonic())
        if problem is not None:
            self._log(problem)

    def _check(self) -> None:
        for problem in self._monitor.check(time.monotonic(), self._missing):
            self._log(problem)

    def _log(self, problem: InputProblem) -> None:
        now_s, key = time.monotonic(), (problem.topic, problem.kind)
        if now_s - self._logged_s.get(key, -_LOG_PERIOD_S) < _LOG_PERIOD_S:
            return
        self._logged_s[key] = now_s
        line = problem.text
        if problem.topic:
            infos = self._node.get_publishers_info_by_topic(problem.topic)
            senders = ', '.join(sorted({info.node_name for info in infos})) or 'nobody sends it'
            line = f'{problem.topic} ({senders}): {line}'
        logger = self._node.get_logger()
        if problem.is_harmless:
            logger.info(line)
        else:
            logger.warning(line)


class StampedReply:
    """Publishes a node's reply to one stamp and can retransmit it.

    A simulator in lockstep that receives no answer sends its last tick again; the reply is then
    retransmitted, not computed anew, so a lost message costs time only.
    """

    def __init__(self) -> None:
        self._stamp_ns: int | None = None
        self._sent: list[tuple[Publisher[Any], bytes]] = []

    def begin(self, stamp_ns: int) -> bool:
        """Begin the reply to a stamp.

        Args:
            stamp_ns: Stamp of the input, nanoseconds.

        Returns:
            True where the reply is to be computed; False where the stamp is that of the last
            reply, which has been retransmitted.
        """
        if stamp_ns == self._stamp_ns:
            for publisher, raw in self._sent:
                publisher.publish(raw)
            return False
        self._stamp_ns = stamp_ns
        self._sent.clear()
        return True

    def send(self, publisher: Publisher[Any], raw: bytes) -> None:
        """Publish a serialized message as part of the reply."""
        self._sent.append((publisher, raw))
        publisher.publish(raw)


def header(stamp_ns: int, frame_id: str) -> Header:
    """Return a header, for messages that are built as objects."""
    return Header(stamp=stamp_to_msg(stamp_ns), frame_id=frame_id)


def stamp_to_msg(stamp_ns: int) -> Time:
    """Return nanoseconds as builtin_interfaces/Time."""
    return Time(sec=stamp_ns // _NS_PER_S, nanosec=stamp_ns % _NS_PER_S)


def stamp_from_msg(stamp: Time) -> int:
    """Return builtin_interfaces/Time as nanoseconds."""
    return int(stamp.sec) * _NS_PER_S + int(stamp.nanosec)
