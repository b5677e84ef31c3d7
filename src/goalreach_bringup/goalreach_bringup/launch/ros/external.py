"""Finds and follows nodes that the launcher did not start."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
import logging
import os
import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.publisher import Publisher

from goalreach_bringup.launch.graph import remap_arguments
from goalreach_bringup.launch.plan import RESTARTED_NS, ExternalNodes
from goalreach_learning.steering import STANDING
from goalreach_msgs_py import topics
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.pose_messages import twist_from_raw, twist_to_raw
from goalreach_msgs_py.ros.messaging import (
    RELIABLE_QOS,
    SENSOR_QOS,
    advertise,
    frame_prefix,
    resolved_name,
    subscribe_raw,
)
from goalreach_msgs_py.ros.node import ros_session

_LOG: Final = logging.getLogger(__name__)
_SIGNS: Final[dict[str, tuple[str, type[Any]]]] = {
    topics.ROBOT: (topics.ODOM, Odometry),
    topics.LOCALIZER: (topics.POSE, PoseWithCovarianceStamped),
    topics.ESTIMATOR: (topics.STATE, DiagnosticArray),
    topics.CONTROLLER: (topics.CMD_VEL, TwistStamped),
}
"""By node, a topic whose publisher shows that the node, or a replacement, runs."""
_POLL_S: Final = 0.05
_SETTLE_S: Final = 2.0
"""Time in which services, truth and name of a node are discovered after its topics. Chosen."""
_RECORDER_S: Final = 10.0
_SILENT_S: Final = 2.0
_STOP_S: Final = 1.0
_LOG_NS: Final = 1_000_000_000


def find_external(
    names: Sequence[str], remaps: Sequence[str], is_stopped: Callable[[], bool]
) -> ExternalNodes | None:
    """Wait for nodes by name or by their topics; return what they offer, None if stopped."""
    with _search(remaps) as node:
        logged: list[str] = []
        while missing := [name for name in names if not _is_there(node, name)]:
            if missing != logged:
                signs = ', '.join(f'{n} or a publisher of {_SIGNS[n][0]}' for n in missing)
                domain = os.environ.get('ROS_DOMAIN_ID') or 0
                _LOG.info('waiting for %s in ROS_DOMAIN_ID %s', signs, domain)
            if is_stopped():
                return None
            logged = missing
            time.sleep(_POLL_S)
        until_s = time.monotonic() + _SETTLE_S
        while (found := _describe(node, names)) != ExternalNodes(names=found.names):  # offers all
            if time.monotonic() > until_s:
                break
            time.sleep(_POLL_S)
        return found


@contextmanager
def _search(remaps: Sequence[str]) -> Iterator[Node]:
    with ros_session():
        yield Node('run_search', cli_args=remap_arguments(remaps), enable_rosout=False)


def await_recorder(remaps: Sequence[str], is_over: Callable[[], bool]) -> None:
    """Wait until the recorder subscribes to everything that an external robot publishes."""
    with _search(remaps) as node:
        until_s = time.monotonic() + _RECORDER_S
        names = [resolved_name(node, name) for name in (*topics.SENSORS, topics.GROUND_TRUTH)]
        names.append(f'{names[len(topics.SENSORS) - 1]}/compressed')
        while time.monotonic() < until_s and not is_over():
            published = [name for name in names if node.count_publishers(name)]
            if published and all(_is_recorded(node, name) for name in published):
                break
            time.sleep(_POLL_S)


def _is_recorded(node: Node, name: str) -> bool:
    readers = node.get_subscriptions_info_by_topic(name)
    return any(reader.node_name == topics.RECORDER for reader in readers)


def _is_there(node: Node, name: str) -> bool:
    found = (name, node.get_namespace()) in node.get_node_names_and_namespaces()
    return found or node.count_publishers(resolved_name(node, _SIGNS[name][0])) > 0


def _describe(node: Node, names: Sequence[str]) -> ExternalNodes:
    services = {name for name, _ in node.get_service_names_and_types()}
    wanted = (topics.RESET_SERVICE, topics.PAUSE_SERVICE, f'/{topics.ROBOT}/set_parameters')
    truth = resolved_name(node, topics.GROUND_TRUTH)
    controller = (topics.CONTROLLER, node.get_namespace())
    is_ours = topics.ROBOT not in names
    return ExternalNodes(
        names=tuple(names),
        has_reset=is_ours or services >= {resolved_name(node, name) for name in wanted},
        has_truth=is_ours or node.count_publishers(truth) > 0,
        only_drives=topics.CONTROLLER in names
        and controller not in node.get_node_names_and_namespaces(),
    )


class ExternalWatch:
    """Follows external nodes by their topics; where it `stops`, it does if the controller ends."""

    def __init__(
        self, node: Node, external: ExternalNodes, *, stamped: bool, stops: bool = True
    ) -> None:
        self._node, self._stops = node, stops
        self._others_drive = topics.CONTROLLER in external.names
        self._stamped = stamped
        self._command: type[Any] = TwistStamped if stamped else Twist
        self._polled_s = time.monotonic()
        self._heard_s: dict[str, float] = {}
        self._silent: set[str] = set()
        self._newest_ns = 0
        self._clock_restarted = False
        self._stop: Publisher[Any] | None = None
        self._stop_until_s = 0.0
        for name in external.names:
            topic, kind = _SIGNS[name]
            kind = self._command if name == topics.CONTROLLER else kind
            hear = partial(self._hear, name)
            node.create_subscription(kind, topics.relative_name(topic), hear, SENSOR_QOS, raw=True)

    def _hear(self, name: str, raw: bytes) -> None:
        self._heard_s[name] = time.monotonic()
        if name != topics.ROBOT:
            return
        try:
            stamp_ns = stamp_of(raw)
        except MessageError:
            return
        if stamp_ns < self._newest_ns - RESTARTED_NS:
            self._clock_restarted, self._newest_ns = True, stamp_ns
        self._newest_ns = max(self._newest_ns, stamp_ns)

    def poll(self, now_s: float, *, drives: bool) -> bool:
        """Log nodes that fall silent or return; return whether the robot's clock has restarted.

        The robot is stopped where our controller does not run, or another has fallen silent.
        """
        drives = drives or self._others_drive
        unserved_s, self._polled_s = now_s - self._polled_s - _POLL_S, now_s
        for name, heard_s in self._heard_s.items():
            self._heard_s[name] = heard_s + max(0.0, unserved_s)
            silent = now_s - self._heard_s[name] > _SILENT_S
            if silent and name not in self._silent:
                self._silent.add(name)
                _LOG.warning(
                    '%s (external): nothing on %s for %.0f s: the robot waits for it',
                    name, _SIGNS[name][0], _SILENT_S,
                )  # fmt: skip
                drives = drives and name != topics.CONTROLLER
            elif not silent and name in self._silent:
                self._silent.remove(name)
                _LOG.info('%s (external) is back', name)
        if self._stops and not drives:
            self._stop_until_s = now_s + _STOP_S
        self._send_stop(now_s)
        restarted, self._clock_restarted = self._clock_restarted, False
        return restarted

    def _send_stop(self, now_s: float) -> None:
        if now_s < self._stop_until_s:
            self._stop = self._stop or advertise(
                self._node, self._command, topics.CMD_VEL, RELIABLE_QOS
            )
            stamp_ns = 0 if self._stamped else None
            self._stop.publish(twist_to_raw(STANDING, stamp_ns, frame_prefix(self._node)))
        elif self._stop is not None:
            self._node.destroy_publisher(self._stop)  # a robot obeys neither of two drivers
            self._stop = None


def log_commands(node: Node) -> None:
    """Log, once a second, the commands that do not reach the robot."""
    logged_ns = -_LOG_NS

    def on_command(stamp_ns: int, raw: bytes) -> None:
        nonlocal logged_ns
        if abs(stamp_ns - logged_ns) >= _LOG_NS:
            logged_ns, twist = stamp_ns, twist_from_raw(raw)
            _LOG.info(
                'not sent: %.2f m/s, %.2f rad/s', twist.linear_m_per_s, twist.steering_rad_per_s
            )

    subscribe_raw(node, TwistStamped, topics.DISCONNECTED_CMD_VEL, on_command, RELIABLE_QOS)
