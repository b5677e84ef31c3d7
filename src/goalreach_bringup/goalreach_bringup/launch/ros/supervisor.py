"""Brings the graph up, watches over it, and takes it down."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import os
from pathlib import Path
import signal
import sys
import time
from typing import Any, Final

import rclpy
from rclpy.executors import Executor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter_client import AsyncParameterClient

from goalreach_bringup.launch.child_process import NodeProcess, Spare, stop_all
from goalreach_bringup.launch.environment import graph_environment, remove_abandoned
from goalreach_bringup.launch.ros.monitor import RunMonitor
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.parameter_file import NodeParameters, write_parameters
from goalreach_msgs_py.ros.node import GarbageRounds
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, LOCALIZER, NODES, ROBOT

_PERIOD_S = 1.0
_START_S = 20.0


class Pulse:
    """Asks a node for a parameter every second and notes when it last answered.

    Args:
        watcher: The node that asks.
        name: The node that is asked.
        limit_s: Silence after which it counts as hung, once it has answered.
    """

    def __init__(self, watcher: Node, name: str, *, limit_s: float = 4.0) -> None:
        """Make the client."""
        self.limit_s = limit_s
        self._client = AsyncParameterClient(watcher, name)
        self._asked_s: float | None = None
        self._pending: list[Any] = []
        self._heard_s: float | None = None
        self._began_s: float | None = None

    def restart(self, now_s: float) -> None:
        """Forget the past: the node is being started anew."""
        self._began_s, self._heard_s, self._asked_s = now_s, None, None
        self._pending.clear()

    def silent(self, now_s: float) -> bool:
        """Ask again where it is time; return whether the node has been silent for too long."""
        if self._began_s is None:
            self._began_s = now_s
        if any(call.done() for call in self._pending):
            self._heard_s = now_s
            self._pending.clear()
        due = self._asked_s is None or now_s - self._asked_s >= _PERIOD_S
        if due and self._client.services_are_ready():
            # A call can be lost with the process that it went to: never wait for one alone.
            self._pending.append(self._client.get_parameters(['use_sim_time']))
            self._asked_s = now_s
        if self._heard_s is None:
            return now_s - self._began_s > _START_S
        return now_s - self._heard_s > self.limit_s


@dataclass
class Backoff:
    """Counts the deaths of one process and spaces its restarts out.

    Attributes:
        first_delay_s: Wait before the second restart, after none before the first; each further
            one waits twice as long.
        limit: Deaths within the window after which it is given up.
        window_s: Deaths longer ago than this are forgiven.
    """

    first_delay_s: float = 0.2
    limit: int = 5
    window_s: float = 60.0
    _deaths_s: list[float] = field(default_factory=list)

    def died(self, now_s: float) -> float | None:
        """Note a death; return how long to wait before the restart, or None to give up.

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
_COMPOSED: Final = {'composed': 'goalreach_bringup.launch.ros.composed'}
_SPIN_S = 0.05
_BAD_CONFIGURATION = 2


class NodeDiedError(GoalreachError):
    """A process of the graph cannot be kept alive."""

    status = 1


class Graph:
    """The processes of a running graph.

    A process that dies or no longer answers is named, ended and started again, where it left
    off, after a wait that doubles with each death; one that keeps dying ends the run.

    Args:
        parameters: Parameters of every node.
        directory: Where parameter files and logs go.
        composed: Whether all nodes share one process.
        remaps: Remapping rules for every node.
        resume: Gives the parameters that make a restarted process go on, by node.
        tell: Called with one line for the screen when a node is up.
        warn: Called with one line of trouble.
    """

    def __init__(
        self,
        *,
        parameters: NodeParameters,
        directory: Path,
        composed: bool,
        remaps: Sequence[str] = (),
        resume: Callable[[], Mapping[str, dict[str, Any]]],
        tell: Callable[[str], None],
        warn: Callable[[str], None],
    ) -> None:
        """Prepare; nothing is started yet."""
        self._parameters = parameters
        self._directory = directory
        self._modules = _COMPOSED if composed else _MODULES
        self._remaps = [word for rule in remaps for word in ('--remap', rule)]
        self._resume = resume
        self._tell = tell
        self._warn = warn
        self._environment: dict[str, str] = {}
        self._processes: dict[str, NodeProcess] = {}
        self._backoffs = {name: Backoff() for name in self._modules}
        self._restart_at_s: dict[str, float] = {}
        self._missing = set(NODES)
        self._started_s = 0.0

    def start(self) -> None:
        """Start the processes and give this process the same ROS environment."""
        self._environment = graph_environment(os.environ, self._directory)
        os.environ.update(self._environment)
        remove_abandoned()
        self._started_s = time.monotonic()
        write_parameters(self._directory / 'parameters.yaml', self._parameters)
        self._spare = Spare(
            environment=self._environment,
            log_path=self._directory / 'spare.log',
            tell=self._warn,
        )
        for name in self._modules:
            self._launch(name, self._directory / 'parameters.yaml')

    def _launch(self, name: str, parameters_path: Path) -> None:
        arguments = ['--ros-args', '--params-file', str(parameters_path), *self._remaps]
        log_path = self._directory / f'{name}.log'
        process = self._spare.take(name, arguments, log_path)
        self._processes[name] = process or NodeProcess(
            name,
            [sys.executable, '-m', self._modules[name], *arguments],
            environment=self._environment,
            log_path=log_path,
            tell=self._warn,
        )
        self._spare.wait(time.monotonic())

    def follow(self, monitor: RunMonitor, finished: Callable[[], bool]) -> None:
        """Serve the monitor and watch over the processes until the work is finished.

        Raises:
            NodeDiedError: A process could not be kept alive.
        """
        pulses = {name: Pulse(monitor, self._node_of(name)) for name in self._modules}
        executor = EventsExecutor()
        executor.add_node(monitor)
        garbage = GarbageRounds(time.monotonic())
        try:
            while rclpy.ok() and not finished():
                now_s = self._serve(executor)
                self._note_arrivals(monitor, now_s)
                self._spare.look(now_s)
                garbage.look(now_s)
                for name, pulse in pulses.items():
                    self._watch(name, pulse, now_s)
        finally:
            executor.shutdown()

    @staticmethod
    def _serve(executor: Executor) -> float:
        """Serve the monitor for a while; return the time now.

        In lockstep thousands of messages come in a second: to look after the processes at each
        would leave too little time to hear them all.
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

    def _note_arrivals(self, monitor: RunMonitor, now_s: float) -> None:
        if not self._missing:
            return
        for name in sorted(self._missing.intersection(monitor.get_node_names())):
            self._missing.discard(name)
            self._tell(f'{name} is up ({now_s - self._started_s:.1f} s)')
            self._spare.wait(now_s)

    def _watch(self, name: str, pulse: Pulse, now_s: float) -> None:
        if name in self._restart_at_s:
            if now_s >= self._restart_at_s[name]:
                del self._restart_at_s[name]
                self._restart(name, pulse)
            return
        process = self._processes[name]
        if process.status is not None:
            if process.status == _BAD_CONFIGURATION:
                raise NodeDiedError(process.last_words())
            self._lost(name, process.obituary(), now_s)
        elif pulse.silent(now_s):
            process.signal(signal.SIGKILL)
            process.wait(1.0)
            self._lost(name, f'did not answer for {pulse.limit_s:.0f} s and was ended', now_s)

    def _lost(self, name: str, reason: str, now_s: float) -> None:
        delay_s = self._backoffs[name].died(now_s)
        line = f'{name}: error: {reason}'
        if delay_s is None:
            raise NodeDiedError(f'{line}; it keeps dying (log: {self._processes[name].log_path})')
        when = f'in {delay_s:g} s' if delay_s else 'at once'
        self._warn(f'{line}; starting it again {when}')
        self._restart_at_s[name] = now_s + delay_s

    def _restart(self, name: str, pulse: Pulse) -> None:
        changes = self._resume()
        nodes = [name] if name in NODES else list(NODES)
        parameters = {node: {**self._parameters[node], **changes.get(node, {})} for node in nodes}
        path = self._directory / f'{name}-again.yaml'
        write_parameters(path, parameters)
        remove_abandoned()
        self._launch(name, path)
        pulse.restart(time.monotonic())

    def stop(self) -> None:
        """End all processes."""
        for name in stop_all([*self._processes.values(), *self._spare.processes()]):
            self._warn(f'{name}: error: did not end by itself and was killed')
        self._processes.clear()
        remove_abandoned()
