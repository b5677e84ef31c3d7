"""The life of a node: start, diagnostics, executor loop, clean end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import get_default_context

from goalreach_msgs_py.diagnostic_messages import OK, WARN, Status, statuses_to_raw
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.ros import process
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, use_profile
from goalreach_msgs_py.ros.distribution import installed
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, StampedReply, advertise
from goalreach_msgs_py.ros.parameters import warn_of_unknown_parameters
from goalreach_msgs_py.topics import DIAGNOSTICS

NO_LOG_FILE = ('--ros-args', '--disable-external-lib-logs')
"""Arguments of rclpy for a tool: a log file of each call would fill `~/.ros/log`."""
_SPIN_S = 0.25
_FLUSH_S = 0.5
_DIAGNOSTICS_TICKS = 25


class Diagnostics:
    """Publishes the status of a node on `/diagnostics`, once in 25 ticks (1 Hz at 25 Hz).

    To be the node's first publisher: a recorder then knows it once it knows another. The status is
    part of the reply to a tick.
    """

    def __init__(self, node: Node, reply: StampedReply) -> None:
        self._name, self._reply = node.get_name(), reply
        self._publisher = advertise(node, DiagnosticArray, DIAGNOSTICS, RELIABLE_QOS)
        self._ticks = 0

    def tick(
        self,
        stamp_ns: int,
        message: str,
        values: Callable[[], Mapping[str, object]],
        *,
        ok: bool = True,
        reply: StampedReply | None = None,
    ) -> None:
        """Count a tick and publish where it is due, at level WARN where not ok.

        `values` returns details by name; it is called only where the status is published.
        What answers no tick is no part of its reply, but given another.
        """
        self._ticks += 1
        if self._ticks % _DIAGNOSTICS_TICKS != 1:
            return
        status = Status(
            level=OK if ok else WARN,
            name=self._name,
            message=message,
            hardware_id=self._name,
            values={key: str(value) for key, value in values().items()},
        )
        (reply or self._reply).send(self._publisher, statuses_to_raw([status], stamp_ns))


def run_nodes(
    name: str, makers: Sequence[Callable[[], Node]], arguments: Sequence[str] | None = None
) -> int:
    """Run nodes on one executor until SIGINT or SIGTERM; the `main` of a node's executable.

    Signals only set a flag that the loop checks: rclpy's own handlers can interrupt a callback and
    end in a traceback. `name` is that of the process, also in messages that precede the first
    node; `arguments` are those of the process if None.

    Returns:
        Exit status: 0 after a clean end, 2 where the configuration was refused.
    """
    process.set_process_name(name)
    process.terminate_with_launcher()
    process.keep_freed_memory()
    stop = process.StopRequest()
    nodes: list[Node] = []
    try:
        _init(list(sys.argv if arguments is None else arguments))
        with early_participant(name):
            for make_node in makers:
                nodes.append(make_node())
                warn_of_unknown_parameters(nodes[-1])
        _spin(nodes, stop)
    except GoalreachError as error:
        kind = 'parameter ' if isinstance(error, ConfigurationError) else ''
        sys.stderr.write(f'{name}: {kind}{error}'.strip().splitlines()[0] + '\n')
        return error.status
    finally:
        _flush(nodes)
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


@contextmanager
def ros_session(
    arguments: Sequence[str] = (), *, profile: str | None = None
) -> Iterator[ExitStack]:
    """Initialise rclpy for a tool that runs its own loop, without rclpy's signal handlers.

    The Fast DDS profile, that of the graph if None, is used unless the environment sets another.

    Yields:
        A stack for callbacks that clean up before rclpy is shut down.
    """
    use_profile(profile or fast_dds_profile())
    rclpy.init(args=[*arguments, *NO_LOG_FILE], signal_handler_options=SignalHandlerOptions.NO)
    try:
        with ExitStack() as stack:
            yield stack
    finally:
        rclpy.try_shutdown()


@contextmanager
def early_participant(name: str) -> Iterator[None]:
    """Create the DDS participant of this process, discovered while the block makes its nodes.

    Fast DDS answers a participant that asks for what it has missed only after a tenth of a second.
    A participant is created with the first node of a process; this one is hidden, has no topics
    and lasts as long as the block. `rclpy.node.Node` would have topics, and what disappears again
    while others ask for it delays them by a second.
    """
    context = get_default_context()
    rosout = [RELIABLE_QOS.get_c_qos_profile()] if installed().node_takes_rosout_qos else []
    with context.handle:
        arguments = f'_{name}', '', context.handle, None, False, False, *rosout
        node = rclpy_implementation.Node(*arguments)
    try:
        yield
    finally:
        node.destroy_when_not_in_use()


def _flush(nodes: Sequence[Node]) -> None:
    """Wait up to 0.5 s until reliable subscribers have received what was published."""
    deadline_s = time.monotonic() + _FLUSH_S
    for publisher in (publisher for node in nodes for publisher in node.publishers):
        left_s = deadline_s - time.monotonic()
        if left_s > 0.0:
            publisher.wait_for_all_acked(Duration(seconds=left_s))


def _spin(nodes: Sequence[Node], stop: process.StopRequest) -> None:
    executor = EventsExecutor()
    for node in nodes:
        executor.add_node(node)
    periodic_gc = process.PeriodicGc(time.monotonic())
    try:
        while not stop.requested:
            executor.spin_once(timeout_sec=_SPIN_S)
            periodic_gc.collect_if_due(time.monotonic())
    except ExternalShutdownException:
        pass
    finally:
        executor.shutdown()


def _init(arguments: list[str]) -> None:
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # rclpy's RCLError: the arguments after --ros-args are wrong
        reason = str(error).partition(': ')[2].partition(', at ')[0]
        raise GoalreachError(reason or str(error)) from None
