"""Brings the graph up, follows it, and takes it down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import os
from pathlib import Path
import sys
import time
from typing import Final

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from goalreach_bringup.run.environment import graph_environment
from goalreach_bringup.run.node_process import NodeProcess, stop_all
from goalreach_bringup.run.plan import CONTROLLER, ESTIMATOR, LOCALIZER, NODES, ROBOT
from goalreach_msgs_py.errors import GoalreachError

__all__ = ['Graph', 'NodeDiedError']

_MODULES: Final = {
    ROBOT: 'goalreach_sim.nomad200_node',
    LOCALIZER: 'goalreach_perception.landmark_localizer_node',
    ESTIMATOR: 'goalreach_perception.state_estimator_node',
    CONTROLLER: 'goalreach_learning.goal_reaching_controller_node',
}
_COMPOSED: Final = {'composed': 'goalreach_bringup.run.ros_composed'}
_SPIN_S = 0.1


class NodeDiedError(GoalreachError):
    """A node's process ended while the run still needed it."""


@dataclass
class Graph:
    """The processes of a running graph.

    Attributes:
        parameters_path: The parameter file that every node gets.
        directory: Where the logs go.
        composed: Whether all nodes share one process.
        tell: Called with one line for the screen when a node is up or complains.
        warn: Called with one line of trouble.
    """

    parameters_path: Path
    directory: Path
    composed: bool
    tell: Callable[[str], None]
    warn: Callable[[str], None]
    _processes: list[NodeProcess] = field(default_factory=list)
    _started_s: float = 0.0
    _missing: set[str] = field(default_factory=set)

    def start(self) -> None:
        """Start the processes and become a ROS process with the same environment."""
        environment = graph_environment(os.environ, self.directory)
        os.environ.update(environment)
        self._started_s = time.monotonic()
        self._missing = set(NODES)
        modules = _COMPOSED if self.composed else _MODULES
        for name, module in modules.items():
            command = [sys.executable, '-m', module, '--ros-args']
            command += ['--params-file', str(self.parameters_path)]
            self._processes.append(
                NodeProcess(
                    name,
                    command,
                    environment=environment,
                    log_path=self.directory / f'{name}.log',
                    tell=self.warn,
                )
            )

    def follow(self, monitor: Node, finished: Callable[[], bool]) -> None:
        """Serve the monitor until the work is finished.

        Raises:
            NodeDiedError: A process ended before.
        """
        executor = SingleThreadedExecutor()
        executor.add_node(monitor)
        try:
            while rclpy.ok() and not finished():
                executor.spin_once(timeout_sec=_SPIN_S)
                self._note_arrivals(monitor)
                self._require_alive()
        finally:
            executor.shutdown()

    def _note_arrivals(self, monitor: Node) -> None:
        if not self._missing:
            return
        for name in sorted(self._missing.intersection(monitor.get_node_names())):
            self._missing.discard(name)
            self.tell(f'{name} is up ({time.monotonic() - self._started_s:.1f} s)')

    def _require_alive(self) -> None:
        for process in self._processes:
            if process.status is not None:
                words = process.last_words() or 'nothing in its log'
                line = f'{process.name} ended with status {process.status}: {words}'
                raise NodeDiedError(f'{line} (log: {process.log_path})')

    def stop(self) -> None:
        """End all processes."""
        for name in stop_all(self._processes):
            self.warn(f'{name}: error: did not end by itself and was killed')
        self._processes.clear()
