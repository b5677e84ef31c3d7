"""The recorder's word to a run: I am there, and this tick is safe."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node
from std_msgs.msg import Header

from goalreach_msgs_py.ros_common_messages import header
from goalreach_msgs_py.ros_qos import RELIABLE_QOS
from goalreach_msgs_py.topics import RECORDED

__all__ = ['RecordedTopic']


class RecordedTopic:
    """Publisher of `/_recorded`; that it exists says that the recorder is there.

    Args:
        node: The recorder.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher: Any = None
        self._confirmed_ns: int | None = None
        self._ended = False

    @property
    def announced(self) -> bool:
        """Whether the run has been told."""
        return self._publisher is not None

    def announce(self) -> None:
        """Tell the run that the recorder is there."""
        self._publisher = self._node.create_publisher(Header, RECORDED, RELIABLE_QOS)

    def confirm(self, stamp_ns: int, *, again: bool) -> None:
        """Say that a tick has been received whole.

        Args:
            stamp_ns: The tick.
            again: Whether to repeat what was said before: the run seems not to have heard it.
        """
        if self._publisher is None or self._ended:
            return
        if stamp_ns != self._confirmed_ns or again:
            self._confirmed_ns = stamp_ns
            self._publisher.publish(header(stamp_ns, ''))

    def end(self) -> None:
        """Say nothing more: a run in lockstep then stands still after its present tick."""
        self._ended = True
