"""The processes of the graph: starts them, restarts those that fail, and stops them.

The caller detects processes that no longer answer: nothing here needs ROS.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import logging
from pathlib import Path
import signal
import time
from typing import Any, Final

from goalreach_bringup.launch.child_process import (
    NODES_MODULE,
    ChildProcess,
    start_fork_server,
    stop_all,
)
from goalreach_bringup.launch.environment import remove_abandoned
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.parameter_file import NodeParameters, write_parameters

_LOG: Final = logging.getLogger(__name__)


class NodeDiedError(GoalreachError):
    """A process of the graph cannot be kept alive."""

    status = 1


def remap_arguments(rules: Sequence[str]) -> list[str]:
    """Return remapping rules as the command line of a node."""
    return ['--ros-args', *(word for rule in rules for word in ('--remap', rule))]


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
        """Count a death; return how long to wait before the restart, or None for no restart."""
        self._deaths_s = [t for t in self._deaths_s if now_s - t < self.window_s] + [now_s]
        if len(self._deaths_s) >= self.limit:
            return None
        before = len(self._deaths_s) - 1
        return float(self.first_delay_s * 2.0 ** (before - 1)) if before else 0.0


@dataclass(kw_only=True)
class Graph:
    """The processes of a running graph.

    A process that dies or no longer answers is reported, ended and restarted from where the run
    is, after a delay that doubles with each death; one that keeps dying ends the run.

    Attributes:
        namespace: Namespace of the nodes, for their parameter files.
        nodes: The nodes that it starts.
        processes: The nodes of each process, by its name.
        started_s: When the start began, by a monotonic clock; 0 before.
    """

    parameters: NodeParameters
    directory: Path
    composed: bool
    remaps: Sequence[str]
    namespace: str
    nodes: tuple[str, ...]
    _processes: dict[str, ChildProcess] = field(default_factory=dict, init=False)
    _restart_at_s: dict[str, float] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        self.processes: dict[str, tuple[str, ...]] = {name: (name,) for name in self.nodes}
        if self.composed and self.nodes:
            self.processes = {'composed': self.nodes}
        self._backoffs = {name: Backoff() for name in self.processes}
        self.started_s = 0.0

    def start(self) -> None:
        """Start the processes."""
        start_fork_server()
        remove_abandoned()
        self.started_s = time.monotonic()
        for name in self.processes:
            self._launch(name, {})

    def is_down(self, node: str) -> bool:
        """Return whether the process of a node has ended and is not restarted yet."""
        return any(node in self.processes[name] for name in self._restart_at_s)

    def restart(self, changes: Mapping[str, dict[str, Any]]) -> None:
        """Restart all processes, with the parameters that make them continue where the run is."""
        stop_all(list(self._processes.values()))
        self._restart_at_s.clear()
        remove_abandoned()
        for name in self.processes:
            self._launch(name, changes)

    def supervise(
        self,
        name: str,
        now_s: float,
        silent: Callable[[float], bool],
        resume: Callable[[], Mapping[str, dict[str, Any]]],
    ) -> bool:
        """Read the log of a process; restart it where it has died or no longer answers.

        `silent` returns whether it has been silent for too long, `resume` the parameters that make
        it continue where the run is. Returns whether it was restarted just now.

        Raises:
            NodeDiedError: It cannot be kept alive.
        """
        if name in self._restart_at_s:
            if now_s < self._restart_at_s[name]:
                return False
            del self._restart_at_s[name]
            remove_abandoned()
            self._launch(name, resume())
            return True
        process = self._processes[name]
        process.read_log()
        if process.exit_status is not None:
            if process.exit_status == GoalreachError.status:
                raise NodeDiedError(process.last_log_line())
            self._lost(name, process.exit_summary(), now_s)
        elif silent(now_s):
            process.signal(signal.SIGKILL)
            process.wait(1.0)
            self._lost(name, 'did not answer in time and was ended', now_s)
        return False

    def _lost(self, name: str, reason: str, now_s: float) -> None:
        delay_s = self._backoffs[name].died(now_s)
        line = f'{name}: error: {reason}'
        if delay_s is None:
            raise NodeDiedError(f'{line}; it keeps dying (log: {self._processes[name].log_path})')
        when = f'in {delay_s:g} s' if delay_s else 'at once'
        _LOG.error('%s; restarting it %s', line, when)
        self._restart_at_s[name] = now_s + delay_s

    def _launch(self, name: str, changes: Mapping[str, dict[str, Any]]) -> None:
        parameters = {
            node: {**self.parameters[node], **changes.get(node, {})}
            for node in self.processes[name]
        }
        path = self.directory / f'{name}.yaml'
        write_parameters(path, parameters, self.namespace)
        words = [*self.processes[name], *remap_arguments(self.remaps), '--params-file', str(path)]
        log_path = self.directory / f'{name}.log'
        self._processes[name] = ChildProcess(name, NODES_MODULE, words, log_path=log_path)

    def stop(self) -> None:
        """End all processes."""
        for name in stop_all(list(self._processes.values())):
            _LOG.error('%s: error: did not end by itself and was killed', name)
        self._processes.clear()
        remove_abandoned()
