"""Reads the clock of a running graph now and then, at next to no cost."""

from __future__ import annotations

import os
import time
from typing import Final

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from goalreach_dashboard.ros.subscriptions import PolledSubscription
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.common_messages import stamp_from_msg
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile
from goalreach_msgs_py.topics import CLOCK

_LOOK_S: Final = 0.05


class RunClock:
    """The clock of the graph in a domain; only the newest tick is kept, and taken when asked.

    Args:
        domain: ROS domain.
    """

    def __init__(self, domain: int) -> None:
        """Join the graph."""
        os.environ.setdefault('FASTRTPS_DEFAULT_PROFILES_FILE', fast_dds_profile())
        self._context = Context()
        rclpy.init(args=[], context=self._context, domain_id=domain)
        self._node = Node('run_clock', context=self._context, enable_rosout=False)
        self._subscription = PolledSubscription(self._node, Clock, CLOCK)
        self._now_s = 0.0

    def now_s(self) -> float:
        """Return simulated seconds by the newest tick; 0 before the first."""
        for message in self._subscription.take():
            self._now_s = stamp_from_msg(message.clock) * 1e-9
        return self._now_s

    def wait_until(self, clock_s: float, limit_s: float) -> None:
        """Wait until the clock has come so far.

        Raises:
            GoalreachError: It has not, within so many seconds of the wall clock.
        """
        deadline_s = time.monotonic() + limit_s
        while self.now_s() < clock_s:
            if time.monotonic() > deadline_s:
                raise GoalreachError(f'the graph stands at {self._now_s:.1f} s')
            time.sleep(_LOOK_S)

    def close(self) -> None:
        """Leave the graph."""
        self._node.destroy_node()
        self._context.try_shutdown()
