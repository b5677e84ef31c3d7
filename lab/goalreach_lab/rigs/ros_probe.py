"""Measures a running graph from a process of its own; the same for our graph and for floors.

    python -m goalreach_lab.rigs.ros_probe ticks|latency|motion|nodes|stops [NUMBER]

Prints its result as a line of JSON; `motion` and `nodes` print a line before, once they listen.
`stops` then stops itself by SIGSTOP.
Times are of the monotonic clock, which all processes of a machine share.
"""

from collections.abc import Callable
import json
import os
import signal
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
from sensor_msgs.msg import CameraInfo, Image

from goalreach_msgs_py.pose_messages import twist_from_raw
from goalreach_msgs_py.ros.messaging import DEEP_QOS, SENSOR_QOS, subscribe_raw
from goalreach_msgs_py.ros.process import terminate_with_launcher
from goalreach_msgs_py.topics import CAMERA_INFO, CLOCK, CMD_VEL, IMAGE
from goalreach_msgs_py.values import Twist2

_LIMIT_S = 90.0
_SETTLE_S = 1.0
_SPIN_S = 0.02
_AT_REST = Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)


class _Probe:
    """A node and its executor; each public method is a kind of measurement."""

    def __init__(self) -> None:
        self.node = Node('probe')
        self._executor: Executor = EventsExecutor()
        self._executor.add_node(self.node)

    def serve(self, until: Callable[[], bool], limit_s: float = _LIMIT_S) -> bool:
        """Spin until a condition holds; return whether it does."""
        end_s = time.monotonic() + limit_s
        while not until():
            if time.monotonic() > end_s:
                return False
            self._executor.spin_once(timeout_sec=_SPIN_S)
        return True

    def ticks(self, seconds: float) -> dict[str, Any]:
        """Return stamp and time of a tick now and of one after so many seconds.

        The probe sleeps in between and keeps only the newest message, so that it takes hardly any
        processor time from the graph.
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
        """Return the first tick that arrives after those already queued."""
        self.serve(lambda: False, limit_s=2 * _SPIN_S)
        count = len(seen)
        self.serve(lambda: len(seen) > count)
        return seen[-1]

    def latency(self, seconds: float) -> dict[str, Any]:
        """Return the times from the camera info, sent just before an image, to its command, ms."""
        sent_s: dict[int, float] = {}
        took_ms: list[float] = []

        def on_camera(stamp_ns: int, _raw: bytes) -> None:
            sent_s[stamp_ns] = time.monotonic()

        def on_command(stamp_ns: int, _raw: bytes) -> None:
            if stamp_ns in sent_s:
                took_ms.append((time.monotonic() - sent_s.pop(stamp_ns)) * 1e3)

        subscribe_raw(self.node, CameraInfo, CAMERA_INFO, on_camera, SENSOR_QOS)
        subscribe_raw(self.node, TwistStamped, CMD_VEL, on_command, DEEP_QOS)
        self.serve(lambda: len(took_ms) > 1)
        self.serve(lambda: False, limit_s=_SETTLE_S)
        took_ms.clear()
        self.serve(lambda: False, limit_s=seconds)
        return {'took_ms': took_ms}

    def motion(self, _: float) -> dict[str, Any]:
        """Return when the first command arrived that moves the robot."""
        moved_s: list[float] = []

        def on_command(_stamp_ns: int, raw: bytes) -> None:
            if twist_from_raw(raw) != _AT_REST:
                moved_s.append(time.monotonic())

        subscribe_raw(self.node, TwistStamped, CMD_VEL, on_command, DEEP_QOS)
        _print({'listens': True})
        self.serve(lambda: bool(moved_s))
        return {'at_s': moved_s[0] if moved_s else None}

    def nodes(self, count: float) -> dict[str, Any]:
        """Return when so many other nodes were discovered."""
        _print({'listens': True})
        found = self.serve(lambda: len(self.node.get_node_names()) > count)
        return {'at_s': time.monotonic() if found else None}

    def stops(self, depth: float) -> dict[str, Any]:
        """Take images reliably with a queue of so many; stop after the first, until SIGCONT."""
        images: list[int] = []
        subscribe_raw(
            self.node, Image, IMAGE, lambda stamp_ns, _: images.append(stamp_ns), int(depth)
        )
        self.serve(lambda: bool(images))
        _print({'stopped': bool(images)})
        os.kill(os.getpid(), signal.SIGSTOP)
        return {}


def _print(values: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(values) + '\n')
    sys.stdout.flush()


def main() -> None:
    """Measure, and print the result."""
    terminate_with_launcher()
    kind, number = sys.argv[1], float(sys.argv[2])
    rclpy.init(args=[])
    try:
        _print(getattr(_Probe(), kind)(number))
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
