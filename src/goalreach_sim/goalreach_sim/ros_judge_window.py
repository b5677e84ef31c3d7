"""How far a lockstep run may be ahead of whoever judges it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

from rclpy.node import Node
from std_msgs.msg import Header

from goalreach_msgs_py.ros_common_messages import stamp_from_msg
from goalreach_msgs_py.ros_qos import RELIABLE_QOS
from goalreach_msgs_py.topics import JUDGED

__all__ = ['JudgeWindow']

_MOST_TICKS: Final = 100
"""Chosen: half of what the judge's queues hold, so that none is lost; it hardly ever counts, since
judging a tick costs less than making it."""


class JudgeWindow:
    """Counts the ticks that the judge has not heard yet.

    Subscribes: `/_judged`, the stamp of the last tick heard, every few ticks.

    Args:
        node: The node that ticks.
        judged: Whether a judge belongs to the run.
        on_room: Called when there is room again.
    """

    def __init__(self, node: Node, *, judged: bool, on_room: Callable[[], None]) -> None:
        """Listen."""
        self._node = node
        self._on_room = on_room
        self._ahead: deque[int] = deque()
        self._judged = judged
        self._seen = False
        if judged:
            node.create_subscription(Header, JUDGED, self._on_judged, RELIABLE_QOS)

    @property
    def full(self) -> bool:
        """Whether to wait for the judge."""
        return self._judged and len(self._ahead) >= _MOST_TICKS

    def ticked(self, stamp_ns: int) -> None:
        """Note a tick."""
        if self._judged:
            self._ahead.append(stamp_ns)

    def look(self) -> None:
        """Go on without a judge that has gone."""
        there = self._node.count_publishers(JUDGED) > 0
        self._seen = self._seen or there
        if self._judged and self._seen and not there:
            self._node.get_logger().info('the judge has gone; the run goes on without it')
            self._judged = False
            self._on_room()

    def _on_judged(self, message: Header) -> None:
        waited = self.full
        stamp_ns = stamp_from_msg(message.stamp)
        while self._ahead and self._ahead[0] <= stamp_ns:
            self._ahead.popleft()
        if waited and not self.full:
            self._on_room()
