"""Starts the processes of the graph, restarts those that fail, and stops them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import logging
from pathlib import Path
import signal
import time
from typing import Any, Final

import rclpy
from rclpy.executors import Executor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter_client import AsyncParameterClient

from goalreach_bringup.launch.child_process import ChildProcess, start_fork_server, stop_all
from goalreach_bringup.launch.environment import remove_abandoned
from goalreach_bringup.launch.ros.monitor import RunMonitor
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.parameter_file import NodeParameters, write_parameters
from goalreach_msgs_py.ros.node import PeriodicGc
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, LOCALIZER, NODES, ROBOT

_LOG: Final = logging.getLogger(__name__)
_PERIOD_S = 1.0
_START_S = 20.0


class LivenessProbe:
    """Requests a parameter of a node every second and notes when it last answered.

    Args:
        watcher: The node that sends the requests.
        name: The node that is probed.
        limit_s: Silence after which it counts as hung, once it has answered.
    """

    def __init__(self, watcher: Node, name: str, *, limit_s: float = 4.0) -> None:
        self.limit_s = limit_s
        self._client = AsyncParameterClient(watcher, name)
        self._requested_s: float | None = None
        self._pending: list[Any] = []
        self._answered_s: float | None = None
        self._began_s: float | None = None

    def restart(self, now_s: float) -> None:
        """Forget earlier answers: the node is being restarted."""
        self._began_s, self._answered_s, self._requested_s = now_s, None, None
        self._pending.clear()

    def silent(self, now_s: float) -> bool:
        """Send a request where one is due; return whether the node has been silent too long."""
        if self._began_s is None:
            self._began_s = now_s
        if any(call.done() for call in self._pending):
            self._answered_s = now_s
            self._pending.clear()
        due = self._requested_s is None or now_s - self._requested_s >= _PERIOD_S
        if due and self._client.services_are_ready():
            # A request can be lost with the process that it went to: never wait for one alone.
            self._pending.append(self._client.get_parameters(['use_sim_time']))
            self._requested_s = now_s
        if self._answered_s is None:
            return now_s - self._began_s > _START_S
        return now_s - self._answered_s > self.limit_s


@dataclass
class Backoff:
    """Counts the deaths of one process and delays its restarts.

    Attributes:
        first_delay_s: Delay of the second restart; the first has none, each further one twice
            that of the one before.
        limit: Deaths within the window after which there is no further restart.
        window_s: Deaths longer ago than this do not count.
    """

    first_delay_s: float = 0.2
    limit: int = 5
    window_s: float = 60.0
    _deaths_s: list[float] = field(default_factory=list)

    def died(self, now_s: float) -> float | None:
        """Count a death; return how long to wait before the restart, or None for no restart.

        Args:
            now_s: Time of the death on any steady clock, seconds.
        """
        self._deaths_s = [t for t in self._deaths_s if now_s - t < self.window_s] + [now_s]
        if len(self._deaths_s) >= self.limit:
            return None
        before = len(self._deaths_s) - 1
        return float(self.first_delay_s * 2.0 ** (before - 1)) if before else 0.0


_MODULES: Final = {
    ROBOT: 'goalreach_sim.nomad200_node',
    LOCALIZER: 'goalreach_perception.landmark_localizer_node',
    ESTIMATOR: 'goalreach_perception.state_estimator_node',
    CONTROLLER: 'goalreach_learning.goal_reaching_controller_node',
}
_COMPOSED: Final = {'composed': 'goalreach_bringup.launch.ros.nodes'}
_SPIN_S = 0.05
_BAD_CONFIGURATION = 2


class NodeDiedError(GoalreachError):
    """A process of the graph cannot be kept alive."""

    status = 1


class Graph:
    """The processes of a running graph.

    A process that dies or no longer answers is reported, ended and restarted from where the run
    is, after a delay that doubles with each death; one that keeps dying ends the run.

    Args:
        parameters: Parameters of every node.
        directory: Directory for parameter files and logs.
        environment: Environment of the processes.
        composed: Whether all nodes share one process.
        remaps: Remapping rules for every node.
    """

    def __init__(
        self,
        *,
        parameters: NodeParameters,
        directory: Path,
        environment: Mapping[str, str],
        composed: bool,
        remaps: Sequence[str] = (),
    ) -> None:
        self._parameters = parameters
        self._directory = directory
        self._environment = environment
        self._modules = _COMPOSED if composed else _MODULES
        self._remaps = [word for rule in remaps for word in ('--remap', rule)]
        self._processes: dict[str, ChildProcess] = {}
        self._backoffs = {name: Backoff() for name in self._modules}
        self._restart_at_s: dict[str, float] = {}
        self._missing = set(NODES)
        self.parameters_path = directory / 'parameters.yaml'
        self._started_s = time.monotonic()

    def start(self) -> None:
        """Start the processes."""
        start_fork_server()
        remove_abandoned()
        write_parameters(self.parameters_path, self._parameters)
        for name in self._modules:
            self._launch(name, self.parameters_path)

    def _launch(self, name: str, parameters_path: Path) -> None:
        self._processes[name] = ChildProcess(
            name,
            self._modules[name],
            ['--ros-args', '--params-file', str(parameters_path), *self._remaps],
            environment=self._environment,
            log_path=self._directory / f'{name}.log',
        )

    def follow(
        self,
        monitor: RunMonitor,
        finished: Callable[[], bool],
        resume: Callable[[], Mapping[str, dict[str, Any]]],
    ) -> None:
        """Serve the monitor and supervise the processes until the work is finished.

        Args:
            monitor: The launcher's own node.
            finished: Returns whether the work is finished.
            resume: Returns the parameters that make a restarted process continue, by node.

        Raises:
            NodeDiedError: A process could not be kept alive.
        """
        probes = {name: LivenessProbe(monitor, self._node_of(name)) for name in self._modules}
        executor = EventsExecutor()
        executor.add_node(monitor)
        garbage = PeriodicGc(time.monotonic())
        try:
            while rclpy.ok() and not finished():
                now_s = self._serve(executor)
                self._report_arrivals(monitor, now_s)
                garbage.collect_if_due(now_s)
                for name, probe in probes.items():
                    self._supervise(name, probe, now_s, resume)
        finally:
            executor.shutdown()

    @staticmethod
    def _serve(executor: Executor) -> float:
        """Serve the monitor for a while; return the time now.

        In lockstep thousands of messages arrive per second: checking the processes after each
        would leave too little time to receive them all.
        """
        end_s = (now_s := time.monotonic()) + _SPIN_S
        while now_s < end_s:
            executor.spin_once(timeout_sec=end_s - now_s)
            now_s = time.monotonic()
        return now_s

    @staticmethod
    def _node_of(process: str) -> str:
        """Return the node whose answer stands for a process."""
        return process if process in NODES else ROBOT

    def _report_arrivals(self, monitor: RunMonitor, now_s: float) -> None:
        if not self._missing:
            return
        for name in sorted(self._missing.intersection(monitor.get_node_names())):
            self._missing.discard(name)
            _LOG.info('%s is up (%.1f s)', name, now_s - self._started_s)

    def _supervise(
        self,
        name: str,
        probe: LivenessProbe,
        now_s: float,
        resume: Callable[[], Mapping[str, dict[str, Any]]],
    ) -> None:
        if name in self._restart_at_s:
            if now_s >= self._restart_at_s[name]:
                del self._restart_at_s[name]
                self._restart(name, resume())
                probe.restart(time.monotonic())
            return
        process = self._processes[name]
        process.read_log()
        if process.exit_status is not None:
            if process.exit_status == _BAD_CONFIGURATION:
                raise NodeDiedError(process.last_log_line())
            self._lost(name, process.exit_summary(), now_s)
        elif probe.silent(now_s):
            process.signal(signal.SIGKILL)
            process.wait(1.0)
            self._lost(name, f'did not answer for {probe.limit_s:.0f} s and was ended', now_s)

    def _lost(self, name: str, reason: str, now_s: float) -> None:
        delay_s = self._backoffs[name].died(now_s)
        line = f'{name}: error: {reason}'
        if delay_s is None:
            raise NodeDiedError(f'{line}; it keeps dying (log: {self._processes[name].log_path})')
        when = f'in {delay_s:g} s' if delay_s else 'at once'
        _LOG.error('%s; restarting it %s', line, when)
        self._restart_at_s[name] = now_s + delay_s

    def _restart(self, name: str, changes: Mapping[str, dict[str, Any]]) -> None:
        nodes = [name] if name in NODES else list(NODES)
        parameters = {node: {**self._parameters[node], **changes.get(node, {})} for node in nodes}
        path = self._directory / f'{name}-restart.yaml'
        write_parameters(path, parameters)
        remove_abandoned()
        self._launch(name, path)

    def stop(self) -> None:
        """End all processes."""
        for name in stop_all(list(self._processes.values())):
            _LOG.error('%s: error: did not end by itself and was killed', name)
        self._processes.clear()
        remove_abandoned()
