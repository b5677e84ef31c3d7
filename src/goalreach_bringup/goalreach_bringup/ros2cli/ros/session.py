"""A hidden node through which a `ros2` command inspects the running graph."""

import argparse
from collections.abc import Callable
from contextlib import ExitStack
import os
import time
from typing import Any, Final

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.acknowledgement import participant_of
from goalreach_msgs_py.ros.dds_profile import DISCOVERY_PROFILE, count_local_participants
from goalreach_msgs_py.ros.node import ros_session
from goalreach_msgs_py.ros.process import StopRequest

_STEP_S: Final = 0.05
"""Longest sleep of the executor; chosen: much less than discovery, much more than a callback."""

_SETTLED_S: Final = 0.3
"""The graph must not have changed for so long. Chosen: some times what the endpoints of a
participant need to follow it."""

_UNKNOWN_NODE: Final = '_NODE_NAME_UNKNOWN_'
"""Name in the graph of a node whose endpoint is known before its name."""


class Session(ExitStack):
    """Context manager around a node of the default context and its executor.

    Signals end it between two steps of the executor: inside ROS code they could surface as any
    error.
    """

    def __init__(self, args: argparse.Namespace) -> None:
        super().__init__()
        self.spin_time_s: float = args.spin_time
        # A writer opens the shared memory of a reader that has stopped again for each message.
        os.environ.setdefault('FASTDDS_BUILTIN_TRANSPORTS', 'UDPv4')
        self.enter_context(ros_session(profile=DISCOVERY_PROFILE))
        self._stop = StopRequest()
        self.node: Any = rclpy.create_node(
            f'_ros2cli_{os.getpid()}',
            start_parameter_services=False,
            parameter_overrides=[Parameter('use_sim_time', value=args.use_sim_time)],
        )
        self.callback(self.node.destroy_node)
        self._executor: Any = SingleThreadedExecutor()
        self.callback(self._executor.shutdown, timeout_sec=0)
        self._executor.add_node(self.node)

    def spin_once(self) -> None:
        """Run what is ready, or wait for it; raise SystemExit after SIGINT or SIGTERM."""
        self._executor.spin_once(timeout_sec=_STEP_S)
        if self._stop.requested:
            raise SystemExit(128 + self._stop.signal)

    def spin_until(self, condition: Callable[[], bool], timeout_s: float | None = None) -> bool:
        """Run callbacks until a condition holds or the time is over; return whether it holds."""
        end_s = None if timeout_s is None else time.monotonic() + timeout_s
        while not condition():
            if end_s is not None and time.monotonic() >= end_s:
                return False
            self.spin_once()
        return True

    def result(self, future: Any, timeout_s: float | None = None) -> Any:
        """Return the answer of a service; raise CommandError where the call fails or times out."""
        if not self.spin_until(future.done, timeout_s):
            raise CommandError('Exception while calling service of node: no answer')
        if future.exception() is not None:
            raise CommandError(f'Exception while calling service of node: {future.exception()}')
        return future.result()

    def discover(self, found: Callable[[], bool] | None = None) -> bool:
        """Wait until the graph has settled and a condition holds; return whether it did in time.

        It has settled when it no longer changes and holds a node of every DDS participant of
        this machine. Without a condition there must be another node than this one.
        """
        holds = found or (lambda: len(self.node.get_node_names()) > 1)
        end_s = time.monotonic() + self.spin_time_s
        graph: object = None
        while True:
            now_s = time.monotonic()
            if graph != (graph := (self.node_names(hidden=True), self.topics(), self.services())):
                changed_s = now_s
            if now_s - changed_s >= _SETTLED_S and self._is_complete() and holds():
                return True
            if now_s >= end_s:
                return holds()
            self.spin_once()

    def node_names(self, *, hidden: bool) -> list[str]:
        """Return the sorted full names of the nodes; with `hidden`, those of tools too."""
        names = self.node.get_node_names_and_namespaces()
        return sorted(
            f'{namespace.rstrip("/")}/{name}'
            for name, namespace in names
            if hidden or (name and not name.startswith('_'))
        )

    def topics(self) -> dict[str, list[str]]:
        """Return the types of each topic of the graph by its name, hidden ones too."""
        return dict(sorted(self.node.get_topic_names_and_types()))

    def services(self) -> dict[str, list[str]]:
        """Return the types of each service of the graph by its name, hidden ones too."""
        return dict(sorted(self.node.get_service_names_and_types()))

    def _is_complete(self) -> bool:
        """Return whether a node of each participant of this machine is known by its name."""
        seen = {
            participant_of(info)
            for info in self.node.get_publishers_info_by_topic('/parameter_events')
            if info.node_name != _UNKNOWN_NODE
        }
        return len(seen) >= count_local_participants(self.node.context.get_domain_id())


def full_name(name: str) -> str:
    """Return a node's name with the leading slash that users leave out."""
    return name if name.startswith('/') else f'/{name}'
