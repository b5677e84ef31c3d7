"""Holding the first path back until whoever judges it listens."""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.topic_endpoint_info import TopicEndpointInfo

from goalreach_msgs_py.topics import JUDGED

_POLL_S = 0.02
_COMPLAIN_S = 5.0
_GUID_PREFIX = 12
"""So many bytes of an endpoint's id are those of its participant (DDSI-RTPS, 9.3.1)."""


class JudgeWait:
    """Waits, without blocking the executor, for one node to subscribe to a publisher.

    A path that ends before its judge listens is never judged: in lockstep a short one takes less
    time than two processes may need to find each other. Who sends `/_judged` is the judge, too:
    the names of nodes come as messages, up to a second after what they subscribe to is known.

    Args:
        node: The node whose executor serves the wait.
        publisher: What the judge listens to.
        judge: Name of the judge's node; empty for none, which is never waited for.
    """

    def __init__(self, node: Node, publisher: Publisher[Any], judge: str) -> None:
        """Be ready to wait."""
        self._node = node
        self._topic = publisher.topic_name
        self._judge = judge
        self._then: Callable[[], None] | None = None
        self._complained_s = 0.0
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(_POLL_S, self._poll, clock=steady)
        self._timer.cancel()

    def when_listening(self, then: Callable[[], None]) -> None:
        """Call `then` once the judge listens: now, or later from a timer."""
        self._then = then
        self._complained_s = time.monotonic()
        self._timer.reset()
        self._poll()

    def _poll(self) -> None:
        if self._then is None:
            return
        if self._judge and not self._listens():
            self._complain(time.monotonic())
            return
        then, self._then = self._then, None
        self._timer.cancel()
        then()

    def _listens(self) -> bool:
        listeners = self._node.get_subscriptions_info_by_topic(self._topic)
        voices = self._node.get_publishers_info_by_topic(JUDGED)
        judges = {_participant(voice) for voice in voices}
        return any(
            info.node_name == self._judge or _participant(info) in judges for info in listeners
        )

    def _complain(self, now_s: float) -> None:
        if now_s - self._complained_s >= _COMPLAIN_S:
            self._complained_s = now_s
            line = f'the first path waits for {self._judge} to listen to {self._topic}'
            self._node.get_logger().warning(line)


def _participant(info: TopicEndpointInfo) -> bytes:
    """Return the id of the participant, of a process as a rule, that an endpoint belongs to."""
    return bytes(info.endpoint_gid[:_GUID_PREFIX])
