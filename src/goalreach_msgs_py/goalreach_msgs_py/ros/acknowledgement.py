"""Acknowledgement of ticks: flow control between the simulator and consumers that miss none.

Each consumer has its own topic, `/_acknowledged/NAME`, because DDS reports the publishers of a
topic at once but the names of nodes up to a second later. Names that begin with an
underscore are hidden from `ros2 topic list` and from bags.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.topic_endpoint_info import TopicEndpointInfo

from goalreach_msgs_py.ros.messaging import LATCHED_QOS, stamp_from_msg, stamp_to_msg
from goalreach_msgs_py.topics import acknowledgement_topic

_GUID_PREFIX: Final = 12
"""Bytes of an endpoint's id that identify its participant (DDSI-RTPS, 9.3.1)."""


class Acknowledger:
    """The consumer's side: registers with a window and acknowledges ticks.

    Publishes: `/_acknowledged/NAME` (latched), one status whose name is that of the node, whose
    value is the window; its stamp is the last tick handled, 0 before the first.

    Args:
        node: The consumer.
        window_ticks: How many ticks the simulator may be ahead of the last one acknowledged. It
            continues without this consumer once the node has ended.
        namespace: That of the simulator, `/robot1`, where it is not the consumer's own.
    """

    def __init__(self, node: Node, *, window_ticks: int, namespace: str = '') -> None:
        name = node.get_name()
        window = KeyValue(key='window_ticks', value=str(window_ticks))
        self._message = DiagnosticArray(status=[DiagnosticStatus(name=name, values=[window])])
        topic = acknowledgement_topic(name)
        topic = f'{namespace}/{topic}' if namespace else topic
        self._publisher = node.create_publisher(DiagnosticArray, topic, LATCHED_QOS)
        self._publisher.publish(self._message)

    def acknowledge(self, stamp_ns: int) -> None:
        """Report that a tick and all before it have been handled."""
        self._message.header.stamp = stamp_to_msg(stamp_ns)
        self._publisher.publish(self._message)


@dataclass(kw_only=True)
class _Consumer:
    """State of a consumer; its window is None until it registers."""

    topic: str
    window_ticks: int | None = None
    acknowledged_ns: int = 0


class AcknowledgementGate:
    """The simulator's side: counts the ticks that each consumer has not acknowledged.

    The consumers are names of nodes that must miss no tick. `on_room` is called when the last full
    window has room again, or its consumer has ended.
    """

    def __init__(
        self, node: Node, consumers: Sequence[str], *, period_ns: int, on_room: Callable[[], None]
    ) -> None:
        self._node = node
        self._period_ns = period_ns
        self._on_room = on_room
        self._start_ns: int | None = None
        self._tick_ns = 0
        self._consumers: dict[str, _Consumer] = {}
        for name in consumers:
            topic = acknowledgement_topic(name)
            node.create_subscription(DiagnosticArray, topic, self._on_message, LATCHED_QOS)
            self._consumers[name] = _Consumer(topic=node.resolve_topic_name(topic))

    @property
    def absent(self) -> list[str]:
        """Consumers that have not registered yet."""
        return [name for name, known in self._consumers.items() if known.window_ticks is None]

    @property
    def blocking(self) -> list[str]:
        """Consumers whose window is full: no tick may come before they acknowledge one."""
        return [name for name, known in self._consumers.items() if self._is_full(known)]

    def _is_full(self, consumer: _Consumer) -> bool:
        if consumer.window_ticks is None or self._start_ns is None:
            return False
        handled_ns = max(consumer.acknowledged_ns, self._start_ns)
        return self._tick_ns - handled_ns >= consumer.window_ticks * self._period_ns

    def ticked(self, stamp_ns: int) -> None:
        """Count a tick."""
        if self._start_ns is None:
            self._start_ns = stamp_ns - self._period_ns
        self._tick_ns = stamp_ns

    def forget_lost(self) -> None:
        """Remove consumers that have ended; to be called periodically."""
        for name, known in list(self._consumers.items()):
            if known.window_ticks is None or self._node.count_publishers(known.topic):
                continue
            self._node.get_logger().info(f'{name} has ended; the run continues without it')
            del self._consumers[name]
            self._on_room()

    def _on_message(self, message: DiagnosticArray) -> None:
        status = message.status[0]
        consumer = self._consumers.get(status.name)
        if consumer is None:
            return
        waited = self._is_full(consumer)
        consumer.window_ticks = int(status.values[0].value)
        consumer.acknowledged_ns = stamp_from_msg(message.header.stamp)
        if waited and not self._is_full(consumer):
            self._on_room()


def is_subscribed(node: Node, consumer: str, publisher: Publisher[Any]) -> bool:
    """Return whether a registered consumer subscribes to a publisher of a node.

    The consumer would miss what is published earlier. It is recognised by its process, which owns
    both its acknowledgements and its subscription.
    """
    topic = node.resolve_topic_name(acknowledgement_topic(consumer))
    processes = {participant_of(info) for info in node.get_publishers_info_by_topic(topic)}
    readers = node.get_subscriptions_info_by_topic(publisher.topic_name)
    return any(participant_of(info) in processes for info in readers)


def participant_of(info: TopicEndpointInfo) -> bytes:
    """Return the id of the DDS participant, one per process as a rule, that has an endpoint."""
    return bytes(info.endpoint_gid[:_GUID_PREFIX])
