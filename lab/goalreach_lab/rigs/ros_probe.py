"""Looks at a running graph from outside, in a process of its own; the same for ours and floors.

    python -m goalreach_lab.rigs.ros_probe ticks|latency|motion|nodes [NUMBER]

Prints one line of JSON when it listens, and one with what it saw; times are of the monotonic
clock, which all processes of a machine share.
"""

from __future__ import annotations

from collections.abc import Callable
import json
import sys
import time
from typing import Any

from geometry_msgs.msg import TwistStamped
import rclpy
from rclpy.executors import Executor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo

from goalreach_msgs_py.ros.node import end_with_launcher
from goalreach_msgs_py.ros.raw_robot import twist_from_raw
from goalreach_msgs_py.ros.subscribe_raw import DEEP_QOS, SENSOR_QOS, subscribe_raw
from goalreach_msgs_py.topics import CAMERA_INFO, CLOCK, CMD_VEL
from goalreach_msgs_py.values import Twist2

_LIMIT_S = 40.0
_SETTLE_S = 1.0
_SPIN_S = 0.02
_STANDING = Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)


class _Probe:
    """A node that listens, and what it listens with."""

    def __init__(self) -> None:
        self.node = Node('probe')
        self._executor: Executor = EventsExecutor()
        self._executor.add_node(self.node)

    def serve(self, until: Callable[[], bool], limit_s: float = _LIMIT_S) -> bool:
        """Serve callbacks until a condition holds; return whether it does."""
        end_s = time.monotonic() + limit_s
        while not until():
            if time.monotonic() > end_s:
                return False
            self._executor.spin_once(timeout_sec=_SPIN_S)
        return True

    def ticks(self, seconds: float) -> dict[str, Any]:
        """Return stamp and time of a tick now and of one after so many seconds.

        In between nothing is served, and only the newest message is kept, so that looking on
        takes next to nothing from the graph.
        """
        seen: list[tuple[int, float]] = []
        subscribe_raw(
            self.node,
            Clock,
            CLOCK,
            lambda stamp_ns, _: seen.append((stamp_ns, time.monotonic())),
            QoSProfile(depth=1),
        )
        self.serve(lambda: len(seen) > 1)
        time.sleep(_SETTLE_S)
        first = self._newest(seen)
        time.sleep(seconds)
        last = self._newest(seen)
        return {'stamps_ns': [first[0], last[0]], 'times_s': [first[1], last[1]]}

    def _newest(self, seen: list[tuple[int, float]]) -> tuple[int, float]:
        """Return the first tick that comes after those that were waiting."""
        self.serve(lambda: False, limit_s=2 * _SPIN_S)
        count = len(seen)
        self.serve(lambda: len(seen) > count)
        return seen[-1]

    def latency(self, seconds: float) -> dict[str, Any]:
        """Return the times from the message sent just before an image to its command, ms."""
        asked: dict[int, float] = {}
        took_ms: list[float] = []

        def ask(stamp_ns: int, _raw: bytes) -> None:
            asked[stamp_ns] = time.monotonic()

        def answer(stamp_ns: int, _raw: bytes) -> None:
            if stamp_ns in asked:
                took_ms.append((time.monotonic() - asked.pop(stamp_ns)) * 1e3)

        subscribe_raw(self.node, CameraInfo, CAMERA_INFO, ask, SENSOR_QOS)
        subscribe_raw(self.node, TwistStamped, CMD_VEL, answer, DEEP_QOS)
        self.serve(lambda: len(took_ms) > 1)
        self.serve(lambda: False, limit_s=_SETTLE_S)
        took_ms.clear()
        self.serve(lambda: False, limit_s=seconds)
        return {'took_ms': took_ms}

    def motion(self, _: float) -> dict[str, Any]:
        """Return when the first command came that is not to stand."""
        moved_s: list[float] = []

        def note(_stamp_ns: int, raw: bytes) -> None:
            if twist_from_raw(raw) != _STANDING:
                moved_s.append(time.monotonic())

        subscribe_raw(self.node, TwistStamped, CMD_VEL, note, DEEP_QOS)
        _say({'listens': True})
        self.serve(lambda: bool(moved_s))
        return {'at_s': moved_s[0] if moved_s else None}

    def nodes(self, count: float) -> dict[str, Any]:
        """Return when so many other nodes were known."""
        _say({'listens': True})
        found = self.serve(lambda: len(self.node.get_node_names()) > count)
        return {'at_s': time.monotonic() if found else None}


def _say(what: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(what) + '\n')
    sys.stdout.flush()


def main() -> None:
    """Look, and print what was seen."""
    end_with_launcher()
    kind, number = sys.argv[1], float(sys.argv[2])
    rclpy.init(args=[])
    try:
        _say(getattr(_Probe(), kind)(number))
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
