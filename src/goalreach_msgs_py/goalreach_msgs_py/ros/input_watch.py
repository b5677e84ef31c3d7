"""Tells in a node's log what is wrong with its inputs, and who sends them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import time

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from goalreach_msgs_py.input_watch import InputWatch, Trouble

_PERIOD_S = 0.2
_THROTTLE_S = 2.0


class InputReporter:
    """An `InputWatch` on a node's executor; each kind of trouble is told once in 2 s.

    Args:
        node: The node.
        topics: Its inputs.
        missing: How often each input has been missing, kept by a synchronizer; or None.
    """

    def __init__(
        self, node: Node, topics: Iterable[str], missing: Mapping[str, int] | None = None
    ) -> None:
        """Start to look."""
        self._node = node
        self._watch = InputWatch(topics)
        self._missing = missing
        self._told_s: dict[tuple[str, str], float] = {}
        node.create_timer(_PERIOD_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def heard(self, topic: str, stamp_ns: int) -> None:
        """Take note of a message."""
        trouble = self._watch.heard(topic, stamp_ns, time.monotonic())
        if trouble is not None:
            self._tell(trouble)

    def _look(self) -> None:
        for trouble in self._watch.look(time.monotonic(), self._missing):
            self._tell(trouble)

    def _tell(self, trouble: Trouble) -> None:
        now_s, key = time.monotonic(), (trouble.topic, trouble.kind)
        if now_s - self._told_s.get(key, -_THROTTLE_S) < _THROTTLE_S:
            return
        self._told_s[key] = now_s
        line = trouble.text
        if trouble.topic:
            infos = self._node.get_publishers_info_by_topic(trouble.topic)
            senders = ', '.join(sorted({info.node_name for info in infos})) or 'nobody sends it'
            line = f'{trouble.topic} ({senders}): {line}'
        logger = self._node.get_logger()
        if trouble.is_harmless:
            logger.info(line)
        else:
            logger.warning(line)
