"""Child processes of the launcher, forked from a server that has imported what nodes share.

Most of the start of a node is importing libraries. The fork server of `multiprocessing` imports
them once, while the launcher prepares the run; a child forked from it shares the memory of the
imports, and is restarted as quickly. The server never calls `rclpy.init`.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
import importlib
import logging
import multiprocessing
from multiprocessing import forkserver, resource_tracker
import os
from pathlib import Path
import re
import signal
import socket
import sys
import threading
import time
from types import ModuleType
from typing import Final

from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, LOCALIZER, ROBOT

_LOG: Final = logging.getLogger(__name__)
_NODE_LOG_LINE: Final = re.compile(r'^\[(WARN|ERROR|FATAL)\] \[[^\]]*\] \[([^\]]*)\]: (.*)$')
_GRACE_S: Final = 3.0
_KILL_S: Final = 1.0
_CONTEXT: Final = multiprocessing.get_context('forkserver')

NODE_CLASSES: Final[Mapping[str, str]] = {
    ROBOT: 'goalreach_sim.nomad200_node:Nomad200Node',
    LOCALIZER: 'goalreach_perception.landmark_localizer_node:LandmarkLocalizerNode',
    ESTIMATOR: 'goalreach_perception.state_estimator_node:StateEstimatorNode',
    CONTROLLER: 'goalreach_learning.goal_reaching_controller_node:GoalReachingControllerNode',
}
"""Module and class of each node, by its name."""
NODES_MODULE: Final = 'goalreach_bringup.launch.ros.nodes'
"""Module whose `main` runs nodes; the server imports it."""
IMPORT_ENVIRONMENT: Final[Mapping[str, str]] = {
    'ROS_PYTHON_CHECK_FIELDS': '1',
    'PYTHONUNBUFFERED': '1',
    'OMP_NUM_THREADS': '1',
    'OPENBLAS_NUM_THREADS': '1',
}
"""Environment variables that libraries read when they are imported."""


def start_fork_server() -> None:
    """Start the server; it imports the libraries of the nodes while this process continues.

    A Ctrl-C does not reach it: the launcher ends its children in order.
    """
    for name, value in IMPORT_ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    _CONTEXT.set_forkserver_preload([NODES_MODULE])
    resource_tracker.ensure_running()  # it would unblock the signal
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


class ChildProcess:
    """A child process that runs the `main` of a module and logs to a file.

    Warnings and errors of a node are passed to `logging`.

    Args:
        name: Name of the process, in messages and in the list of processes.
        module: Module with the function `main`.
        arguments: Its command line.
        log_path: File that takes everything the process writes.
        variables: Environment variables that differ from those of this process.
        listener: A listening socket for the process; its number becomes the last argument.
    """

    def __init__(
        self,
        name: str,
        module: str,
        arguments: Sequence[str],
        *,
        log_path: Path,
        variables: Mapping[str, str] | None = None,
        listener: socket.socket | None = None,
    ) -> None:
        self.name = name
        self.log_path = log_path
        self._log = log_path.open('a+', encoding='utf-8', errors='replace')
        self._partial_line = self._last_line = ''
        self._process = _CONTEXT.Process(
            target=_run,
            args=(
                *(module, [name, *arguments], {**os.environ, **(variables or {})}),
                *(str(log_path), listener),
            ),
            daemon=True,
        )
        with _hidden_main():
            self._process.start()

    @property
    def exit_status(self) -> int | None:
        """Exit status, minus the number of the signal that ended it, or None while it runs."""
        return self._process.exitcode

    def read_log(self) -> list[str]:
        """Return the lines written since the last call; report warnings and errors among them."""
        *lines, self._partial_line = (self._partial_line + self._log.read()).split('\n')
        for line in lines:
            self._last_line = line.rstrip() or self._last_line
            found = _NODE_LOG_LINE.match(line)
            if found:
                level = logging.WARNING if found[1] == 'WARN' else logging.ERROR
                _LOG.log(level, '%s: %s: %s', found[2], found[1].lower(), found[3])
        return lines

    def last_log_line(self) -> str:
        """Return the last line that the process wrote."""
        self.read_log()
        return self._partial_line.rstrip() or self._last_line

    def exit_summary(self) -> str:
        """Return how the process ended, as a phrase."""
        status = self.exit_status
        if status is not None and status < 0:
            return f'was ended by {signal.Signals(-status).name}'
        return f'ended with status {status}: {self.last_log_line() or "nothing in its log"}'

    def signal(self, number: signal.Signals) -> None:
        """Send a signal, if the process still runs."""
        if self.exit_status is None and self._process.pid is not None:
            os.kill(self._process.pid, number)

    def wait(self, timeout_s: float) -> bool:
        """Return whether the process ended within the time."""
        self._process.join(timeout_s)
        return self.exit_status is not None


@contextmanager
def _hidden_main() -> Iterator[None]:
    """Keep children from importing the launcher's main module, which they do not need.

    By default they do, and a script without a guard would start a launcher in each.
    """
    main = sys.modules['__main__']
    sys.modules['__main__'] = ModuleType('__main__')
    try:
        yield
    finally:
        sys.modules['__main__'] = main


def _run(
    module: str,
    arguments: list[str],
    environment: dict[str, str],
    log_path: str,
    listener: socket.socket | None,
) -> None:
    """Become the process: own session, log file, signals and name; then run `main`."""
    from goalreach_msgs_py.ros.process import LAUNCHER_PID, set_process_name

    os.setsid()  # a Ctrl-C is for the launcher alone
    log = os.open(log_path, os.O_WRONLY | os.O_APPEND)
    os.dup2(log, 1)
    os.dup2(log, 2)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    os.environ.update(environment, **{LAUNCHER_PID: str(os.getppid())})
    threading.Thread(target=_end_with_launcher, daemon=True).start()
    set_process_name(arguments[0])
    sys.argv = arguments if listener is None else [*arguments, str(listener.detach())]
    sys.exit(importlib.import_module(module).main())


def _end_with_launcher() -> None:
    """Wait for the death of the launcher; the kernel reports that of the fork server."""
    launcher = multiprocessing.parent_process()
    if launcher is not None:
        launcher.join()
        os.kill(os.getpid(), signal.SIGTERM)


def stop_all(processes: Sequence[ChildProcess]) -> list[str]:
    """End processes: SIGINT, after a grace SIGTERM, at last SIGKILL; return who was killed."""
    for number, grace_s in ((signal.SIGINT, _GRACE_S), (signal.SIGTERM, _KILL_S)):
        for process in processes:
            process.signal(number)
        deadline_s = time.monotonic() + grace_s
        for process in processes:
            process.wait(max(0.0, deadline_s - time.monotonic()))
    killed = [process for process in processes if process.exit_status is None]
    for process in killed:
        process.signal(signal.SIGKILL)
        process.wait(_KILL_S)
    for process in processes:
        process.read_log()
    return [process.name for process in killed]
