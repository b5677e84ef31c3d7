"""The clock of a running graph, polled at next to no cost."""

import time
from typing import Final

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from goalreach_dashboard.ros.listener import PolledSubscription, best_effort
from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, use_profile
from goalreach_msgs_py.topics import CLOCK

_POLL_S: Final = 0.05


class RunClock:
    """The clock of the graph in a domain; only its newest tick is kept, and taken on demand.

    Args:
        domain: ROS domain.
    """

    def __init__(self, domain: int) -> None:
        """Join the graph."""
        use_profile(fast_dds_profile())
        self._context = Context()
        rclpy.init(args=[], context=self._context, domain_id=domain)
        self._node = Node('run_clock', context=self._context, enable_rosout=False)
        self._subscription = PolledSubscription(self._node, Clock, CLOCK, best_effort(1))
        self._now_s = 0.0

    def now_s(self) -> float:
        """Return simulated seconds by the newest tick; 0 before the first."""
        for raw in self._subscription.take():
            self._now_s = stamp_of(raw) * 1e-9
        return self._now_s

    def wait_until(self, clock_s: float, limit_s: float) -> None:
        """Wait until the clock shows a time.

        Raises:
            GoalreachError: It does not, within so many seconds of the wall clock.
        """
        deadline_s = time.monotonic() + limit_s
        while self.now_s() < clock_s:
            if time.monotonic() > deadline_s:
                raise GoalreachError(f'the clock of the graph stands at {self._now_s:.1f} s')
            time.sleep(_POLL_S)

    def close(self) -> None:
        """Leave the graph."""
        self._node.destroy_node()
        self._context.try_shutdown()
