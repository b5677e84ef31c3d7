"""How nodes publish and subscribe: quality of service, subscriptions, replies, bad inputs, stamps.

Publishers are reliable, so that every subscriber is served; sensor data are received best effort,
so that every driver serves us (REP-2003). Writers keep their last messages and wait for no reader.

A node publishes a value as `publisher.publish(x_to_raw(value, stamp_ns))`, or as part of a
`StampedReply`, and receives it from `subscribe_raw` for `x_from_raw`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import copy
import time
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, InvalidQoSProfileException, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.timer import Timer
from std_msgs.msg import Header

from goalreach_msgs_py.alignment import InputAligner
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.inputs import ABSENT_KINDS, InputMonitor, InputProblem
from goalreach_msgs_py.topics import relative_name

SENSOR_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For readers of sensor data but images."""

NEWEST_QOS = QoSProfile(depth=2, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For readers of images. After a pause only the newest counts, and DDS keeps the buffer of a whole
image for each place of the queue that was ever full. With one place a hundredth of the images is
lost in real time, with two hardly any."""

SAMPLES_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For readers of odometry and joint states, which may come far more often than images."""

RELIABLE_QOS = QoSProfile(depth=10)
"""Sensor data at their source, states, commands and events."""

DEEP_QOS = QoSProfile(depth=200)
"""What is judged and counted: a subscriber that is 200 ticks late still misses none."""

LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""What a late subscriber still needs: markers, Q-table."""

_NS_PER_S = 1_000_000_000
_THROTTLE_S = 5.0
_CHECK_S = 0.2
_POLL_S, _SLOW_POLL_S = 0.02, 1.0
"""Time between two looks at what waits by the wall clock, shortly or for lockstep. Chosen."""
_LOG_PERIOD_S, _ABSENT_PERIOD_S = 2.0, 60.0


def advertise(node: Node, message_type: type[Any], topic: str, qos: QoSProfile) -> Publisher[Any]:
    """Create a publisher in the node's namespace.

    The standard parameters `qos_overrides.TOPIC.publisher.*` override history, depth, reliability.
    rclpy logs, at both ends, the topic and the policy in which a reader does not fit.

    Raises:
        GoalreachError: An override is refused.
    """
    return _create(node.create_publisher, message_type, topic, copy(qos))


def frame_prefix(node: Node) -> str:
    """Return the prefix of the frames of a node: its namespace and a slash, or nothing."""
    return f'{node.get_namespace().strip("/")}/'.lstrip('/')


def resolved_name(node: Node, topic: str) -> str:
    """Return the full name of a topic for a node: counting ends knows of no remapping."""
    return str(node.resolve_topic_name(relative_name(topic)))


def _create(
    create: Callable[..., Any],
    message_type: type[Any],
    topic: str,
    *others: Any,
    entity_id: str | None = None,
    **options: Any,
) -> Any:
    """Create an end of a topic whose quality of service parameters may override."""
    overrides = QoSOverridingOptions.with_default_policies(entity_id=entity_id)
    options['qos_overriding_options'] = overrides
    try:
        return create(message_type, relative_name(topic), *others, **options)
    except (InvalidQoSProfileException, ParameterException, RuntimeError) as error:
        raise GoalreachError(f'qos_overrides of {topic}: {error}') from None


def subscribe_raw(
    node: Node,
    message_type: type[Any],
    topic: str,
    callback: Callable[[int, bytes], None],
    qos: QoSProfile,
    *,
    entity_id: str | None = None,
) -> None:
    """Subscribe to serialized messages; see `advertise` for names and QoS.

    The callback is given the stamp that the message begins with, nanoseconds (without meaning for
    a type that has none), and the message. A `MessageError` that it raises is logged, and the
    message dropped. A second subscription of the node to the same topic would take over the
    parameters of the first: `entity_id` tells it apart, in
    `qos_overrides.TOPIC.subscription_ID.*`.
    """

    def receive(raw: bytes) -> None:
        try:
            callback(stamp_of(raw), raw)
        except MessageError as error:
            line = f'{topic}: {error}'
            node.get_logger().error(line, throttle_duration_sec=_THROTTLE_S)

    create = node.create_subscription
    _create(create, message_type, topic, receive, copy(qos), entity_id=entity_id, raw=True)


def meet_all(profile: QoSProfile, publishers: Iterable[Any]) -> list[str]:
    """Make a profile the strictest in reliability and durability that receives from publishers.

    It is unchanged where there is none.

    Returns:
        A line for the user per policy that not all of them offer.
    """
    offered, notes = [publisher.qos_profile for publisher in publishers], []
    policies = (
        ('reliability', ReliabilityPolicy, 'RELIABLE', 'BEST_EFFORT'),
        ('durability', DurabilityPolicy, 'TRANSIENT_LOCAL', 'VOLATILE'),
    )
    for name, policy, strict, weak in policies if offered else ():
        meets = [getattr(offer, name) == policy[strict] for offer in offered]
        setattr(profile, name, policy[strict if all(meets) else weak])
        if any(meets) and not all(meets):
            notes.append(
                f'Some, but not all, publishers are offering QoS{policy.__name__}.{strict}. '
                f'Falling back to QoS{policy.__name__}.{weak} as it will connect to all publishers'
            )
    return notes


class RawReader:
    """A subscription whose messages are taken on demand, from a node that no executor spins.

    Use it where the reader has a rate of its own, or needs the numbers of messages, which rclpy's
    executors do not pass on. The depth of the QoS is the number of messages kept.
    """

    def __init__(self, node: Node, message_type: type[Any], name: str, qos: QoSProfile) -> None:
        self._node = node
        create = node.create_subscription  # requires a callback, which no executor ever calls
        self._end: Any = create(message_type, name, lambda _: None, qos, raw=True)

    def received(self) -> Iterator[tuple[bytes, Mapping[str, Any]]]:
        """Yield each message that has come, serialized, oldest first, and rclpy's words on it."""
        while True:
            with self._end.handle:
                taken = self._end.handle.take_message(self._end.msg_type, True)
            if taken is None:
                return
            yield taken

    def count_publishers(self) -> int:
        """Return how many publishers are connected."""
        return int(self._end.get_publisher_count())

    def close(self) -> None:
        """Unsubscribe."""
        self._node.destroy_subscription(self._end)


def steady_timer(node: Node, period_s: float, callback: Callable[[], None]) -> Timer:
    """Create a timer that follows the wall clock, whatever the clock of the graph."""
    return node.create_timer(period_s, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))


class InputReporter:
    """Logs what an `InputMonitor` finds wrong with a node's inputs, each problem once in 2 s.

    What never came is logged once a minute.

    Args:
        node: The node, whose executor runs the checks.
        required: The inputs that are reported when they never come.
        missing: How often each input has been missing, counted by an aligner; or None.
        held: Inputs of which one message is enough.
        suffixes: What follows the name of an input whose topic is called otherwise.
    """

    def __init__(
        self,
        node: Node,
        required: Iterable[str] = (),
        missing: Mapping[str, int] | None = None,
        held: Iterable[str] = (),
        suffixes: Mapping[str, str] | None = None,
    ) -> None:
        self._node = node
        self._suffixes = suffixes or {}
        self._monitor = InputMonitor(required, held)
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
        period_s = _ABSENT_PERIOD_S if problem.kind in ABSENT_KINDS else _LOG_PERIOD_S
        if now_s - self._logged_s.get(key, -period_s) < period_s:
            return
        self._logged_s[key] = now_s
        line = problem.text
        if problem.topic:
            suffix = self._suffixes.get(problem.topic, '')
            topic = resolved_name(self._node, problem.topic) + suffix
            infos = self._node.get_publishers_info_by_topic(topic)
            senders = ', '.join(sorted({info.node_name for info in infos})) or 'nobody sends it'
            line = f'{problem.topic}{suffix} ({senders}): {line}'
        logger = self._node.get_logger()
        if problem.is_harmless:
            logger.info(line)
        else:
            logger.warning(line)


class AlignedInputs:
    """An `InputAligner` that is looked at by the wall clock, too, where that limits a wait.

    `process` is called with the leading stamp and the values by name of each complete set.
    """

    def __init__(
        self, node: Node, aligner: InputAligner, process: Callable[[int, dict[str, Any]], None]
    ) -> None:
        self._aligner = aligner
        self._process = process
        steady_timer(node, _SLOW_POLL_S, self._poll)
        self._timer = steady_timer(node, _POLL_S, self._poll)
        self._timer.cancel()

    def add(self, name: str, stamp_ns: int, value: object) -> None:
        """Add a value of an input, and process what is complete."""
        self._pass_on(self._aligner.add(name, stamp_ns, value, time.monotonic()))

    def _poll(self) -> None:
        self._pass_on(self._aligner.complete(time.monotonic()))

    def _pass_on(self, sets: Iterable[tuple[int, dict[str, Any]]]) -> None:
        for stamp_ns, inputs in sets:
            self._process(stamp_ns, inputs)
        if not self._aligner.needs_clock:
            self._timer.cancel()
        elif self._timer.is_canceled():
            self._timer.reset()


class StampedReply:
    """Publishes a node's reply to one stamp and can retransmit it.

    A simulator in lockstep that receives no answer sends its last tick again; the reply is then
    retransmitted, not recomputed, so a lost message costs time only.
    """

    def __init__(self) -> None:
        self._stamp_ns: int | None = None
        self._sent: list[tuple[Publisher[Any], bytes | Callable[[], Any]]] = []

    def begin(self, stamp_ns: int) -> bool:
        """Begin the reply to a stamp; return whether it is to be computed.

        It is not where the stamp is that of the last reply, which has been retransmitted.
        """
        if stamp_ns == self._stamp_ns:
            for sent in self._sent:
                self._publish(*sent)
            return False
        self._stamp_ns = stamp_ns
        self._sent.clear()
        return True

    def send(self, publisher: Publisher[Any], message: bytes | Callable[[], Any]) -> None:
        """Publish a serialized message as part of the reply, or one made for subscribers alone."""
        self._sent.append((publisher, message))
        self._publish(publisher, message)

    def _publish(self, publisher: Publisher[Any], message: bytes | Callable[[], Any]) -> None:
        if not callable(message):
            publisher.publish(message)
        elif publisher.get_subscription_count():
            publisher.publish(message())


def header(stamp_ns: int, frame_id: str) -> Header:
    """Return a header, for messages that are built as objects."""
    return Header(stamp=stamp_to_msg(stamp_ns), frame_id=frame_id)


def stamp_to_msg(stamp_ns: int) -> Time:
    """Return nanoseconds as builtin_interfaces/Time."""
    return Time(sec=stamp_ns // _NS_PER_S, nanosec=stamp_ns % _NS_PER_S)


def stamp_from_msg(stamp: Time) -> int:
    """Return builtin_interfaces/Time as nanoseconds."""
    return int(stamp.sec) * _NS_PER_S + int(stamp.nanosec)
