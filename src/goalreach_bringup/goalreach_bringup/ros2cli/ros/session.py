"""A hidden node through which a `ros2` command inspects the running graph."""

import argparse
from collections.abc import Callable
from contextlib import ExitStack
import os
import signal
import time
from types import FrameType
from typing import Any, Final

import rclpy
from rclpy.exceptions import NameValidationException
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from goalreach_bringup.ros2cli.arguments import TerminatedError, add
from goalreach_bringup.ros2cli.participants_file import count_local_participants
from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.acknowledgement import participant_of
from goalreach_msgs_py.ros.dds_profile import DISCOVERY_PROFILE, use_profile

_STEP_S: Final = 0.05
"""Longest sleep of the executor; chosen: much less than discovery, much more than a callback."""

_SETTLED_S: Final = 0.3
"""The graph must not have changed for so long. Chosen: some times what the endpoints of a
participant need to follow it."""

_DISCOVERY_S: Final = 5.0
"""Longest wait for the graph. Chosen: DDS repeats an announcement that was lost after 3 s, and the
endpoints follow it."""

_UNKNOWN_NODE: Final = '_NODE_NAME_UNKNOWN_'
"""Name in the graph of a node whose endpoint is known before its name."""


def add_verb(
    verbs: Any, name: str, text: str, run: Callable[[argparse.Namespace], None], *rows: Any
) -> argparse.ArgumentParser:
    """Add a verb that looks at the graph, with the options of ros2cli about discovery and time.

    Args:
        verbs: The sub-parsers of the command.
        name: The verb.
        text: Its help.
        run: What it runs.
        rows: Its own arguments, as for `add`.
    """
    verb: argparse.ArgumentParser = verbs.add_parser(name, help=text, description=text)
    wait = 'longest wait for discovery; it ends when the graph has settled (default: %(default)s)'
    add(
        verb,
        *rows,
        ('--spin-time', wait, {'type': float, 'metavar': 'S', 'default': _DISCOVERY_S}),
        ('-s --use-sim-time', 'Enable ROS simulation time'),
        ('--no-daemon', 'accepted for ros2cli; there is never a daemon'),
    )
    verb.set_defaults(run=run)
    return verb


class Session(ExitStack):
    """Context manager around a node of the default context and its executor.

    Signals end it between two steps of the executor: inside ROS code they could surface as any
    error.

    Args:
        args: The parsed options of `add_verb`.
        node_name: Name of the node; hidden and unique if None.

    Attributes:
        spin_time_s: Time allowed for discovery.
    """

    def __init__(self, args: argparse.Namespace, node_name: str | None = None) -> None:
        super().__init__()
        self.spin_time_s: float = args.spin_time
        self._signal: int | None = None
        use_profile(DISCOVERY_PROFILE)
        # A log file for every command would only fill the disk.
        rclpy.init(
            args=['--ros-args', '--disable-external-lib-logs'],
            signal_handler_options=SignalHandlerOptions.NO,
        )
        self.callback(rclpy.try_shutdown)
        for number in (signal.SIGINT, signal.SIGTERM):
            self.callback(signal.signal, number, signal.signal(number, self._on_signal))
        try:
            self.node: Any = rclpy.create_node(
                node_name or f'_ros2cli_{os.getpid()}',
                start_parameter_services=False,
                parameter_overrides=[Parameter('use_sim_time', value=args.use_sim_time)],
            )
        except NameValidationException as error:
            raise CommandError(str(error).splitlines()[0]) from None
        self.callback(self.node.destroy_node)
        self._executor: Any = SingleThreadedExecutor()
        self.callback(self._executor.shutdown, timeout_sec=0)
        self._executor.add_node(self.node)

    def _on_signal(self, number: int, _: FrameType | None) -> None:
        """Store the signal; a second one interrupts at once."""
        if self._signal is not None:
            raise KeyboardInterrupt
        self._signal = number

    def spin_once(self, timeout_s: float = _STEP_S) -> None:
        """Run what is ready, or wait for it.

        Raises:
            KeyboardInterrupt: SIGINT was received.
            TerminatedError: SIGTERM was received.
        """
        self._executor.spin_once(timeout_sec=timeout_s)
        if self._signal is not None:
            raise KeyboardInterrupt if self._signal == signal.SIGINT else TerminatedError

    def spin_until(self, condition: Callable[[], bool], timeout_s: float | None = None) -> bool:
        """Run callbacks until the condition holds; return whether it does.

        Args:
            condition: Evaluated before each step.
            timeout_s: Longest wait, unlimited if None.
        """
        end_s = None if timeout_s is None else time.monotonic() + timeout_s
        while not condition():
            if end_s is not None and time.monotonic() >= end_s:
                return False
            self.spin_once()
        return True

    def result(self, future: Any, timeout_s: float | None, refusal: str) -> Any:
        """Return the result of a future.

        Raises:
            CommandError: It failed or timed out; the message is the refusal.
        """
        if not self.spin_until(future.done, timeout_s):
            raise CommandError(refusal)
        if future.exception() is not None:
            raise CommandError(f'{refusal}: {future.exception()}')
        return future.result()

    def discover(self, found: Callable[[], bool] | None = None) -> bool:
        """Wait until the graph has settled and a condition holds.

        It has settled when it no longer changes and holds a node of every DDS participant of
        this machine.

        Args:
            found: The condition; if None, that there is another node than this one.

        Returns:
            Whether the condition held within the time allowed for discovery.
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
