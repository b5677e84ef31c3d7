"""Follows a running graph: the launcher's node, and a liveness probe of each process."""

from collections.abc import Callable, Mapping
import logging
import math
import time
from typing import Any, Final

import rclpy
from rclpy.executors import Executor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter_client import AsyncParameterClient

from goalreach_bringup.launch.graph import Graph
from goalreach_bringup.launch.ros.external import ExternalWatch
from goalreach_msgs_py.ros.process import PeriodicGc
from goalreach_msgs_py.topics import CONTROLLER

_LOG: Final = logging.getLogger(__name__)
_PERIOD_S = 1.0
_START_S = 20.0
_SILENCE_S = 4.0
"""Silence after which a process that has answered before counts as hung. Chosen."""
_SPIN_S = 0.05


class LivenessProbe:
    """Requests a parameter of a node every second and notes when it last answered."""

    def __init__(self, watcher: Node, name: str, now_s: float) -> None:
        self._client = AsyncParameterClient(watcher, name)
        self._pending: list[Any] = []
        self._polled_s = math.inf
        self.restart(now_s)

    def restart(self, now_s: float) -> None:
        """Forget earlier requests and answers: the node starts now."""
        self._pending.clear()
        self._requested_s, self._until_s = -math.inf, now_s + _START_S

    def silent(self, now_s: float) -> bool:
        """Send a request where one is due; return whether the node has been silent too long.

        The time in which nobody asked, the launcher being stopped, does not count.
        """
        self._until_s += max(0.0, now_s - self._polled_s - _PERIOD_S)
        self._polled_s = now_s
        if any(call.done() for call in self._pending):
            self._until_s = now_s + _SILENCE_S
            self._pending.clear()
        due = now_s - self._requested_s >= _PERIOD_S
        if due and self._client.services_are_ready():
            # A request can be lost with the process that it went to: never wait for one alone.
            self._pending.append(self._client.get_parameters(['use_sim_time']))
            self._requested_s = now_s
        return now_s > self._until_s


def follow(
    graph: Graph,
    monitor: Node,
    finished: Callable[[], bool],
    resume: Callable[[], Mapping[str, dict[str, Any]]],
    watch: ExternalWatch | None = None,
) -> None:
    """Serve the launcher's node and supervise the processes until the work is finished.

    `resume` returns the parameters that make a restarted process continue, by node.

    Raises:
        NodeDiedError: A process could not be kept alive.
    """
    now_s = time.monotonic()
    probes = {
        name: LivenessProbe(monitor, nodes[0], now_s) for name, nodes in graph.processes.items()
    }
    missing = set(graph.nodes)
    executor = EventsExecutor()
    executor.add_node(monitor)
    garbage = PeriodicGc(now_s)
    try:
        while rclpy.ok() and not finished():
            now_s = _serve(executor)
            missing -= _log_arrived(graph, monitor, missing, now_s)
            garbage.collect_if_due(now_s)
            if watch is not None and watch.poll(now_s, drives=not graph.is_down(CONTROLLER)):
                # The nodes refuse what is older than what they have received.
                _LOG.info('the clock of the robot has restarted: restarting the nodes')
                graph.restart(resume())
                for probe in probes.values():
                    probe.restart(time.monotonic())
                continue
            for name, probe in probes.items():
                if graph.supervise(name, now_s, probe.silent, resume):
                    probe.restart(time.monotonic())
    finally:
        executor.shutdown()


def _log_arrived(graph: Graph, monitor: Node, missing: set[str], now_s: float) -> set[str]:
    """Return which of the missing nodes have come up, and log them."""
    found = monitor.get_node_names_and_namespaces() if missing else ()
    arrived = {n for n, space in found if space == monitor.get_namespace()} & missing
    for name in sorted(arrived):
        _LOG.info('%s is up (%.1f s)', name, now_s - graph.started_s)
    return arrived


def _serve(executor: Executor) -> float:
    """Serve the launcher's node for a while; return the time now.

    In lockstep thousands of messages arrive per second: checking the processes after each would
    leave too little time to receive them all.
    """
    end_s = (now_s := time.monotonic()) + _SPIN_S
    while now_s < end_s:
        executor.spin_once(timeout_sec=end_s - now_s)
        now_s = time.monotonic()
    return now_s
