"""How every node of the graph starts, reports and ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import ctypes
import gc
import os
import signal
import sys
import time
from types import FrameType

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from goalreach_msgs_py.diagnostic_messages import OK, WARN, Status, status_to_raw
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS
from goalreach_msgs_py.ros.parameters import warn_of_unknown_parameters
from goalreach_msgs_py.topics import DIAGNOSTICS

_PERIOD_S = 10.0
"""Between full collections; chosen."""


class GarbageRounds:
    """A full collection now and then, for a loop that never has one of its own.

    Only a full collection gives back the tuples that Python keeps for reuse, up to 2000 of each
    length, and where all objects die by their reference counts none ever comes: over hours such a
    process gains some megabytes.

    Args:
        now_s: A clock that only goes forward.
    """

    def __init__(self, now_s: float) -> None:
        """Begin; what exists by now stays to the end and need not be looked through again."""
        gc.freeze()
        self._due_s = now_s + _PERIOD_S

    def look(self, now_s: float) -> None:
        """Collect where it is due; call it in every round of the loop."""
        if now_s < self._due_s:
            return
        gc.collect()
        self._due_s = now_s + _PERIOD_S


LAUNCHER_PID = 'GOALREACH_LAUNCHER_PID'
"""Environment variable by which a launcher asks its nodes to end when it dies."""

_SPIN_S = 0.25
_DELIVERY_S = 0.5
_DIAGNOSTICS_TICKS = 25
_STATUS_BAD_CONFIGURATION = 2
_PR_SET_PDEATHSIG = 1
_PR_SET_NAME = 15
_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3
_LARGEST_KEPT_BYTES = 16 << 20
_MOST_KEPT_BYTES = 64 << 20
"""Sizes for `mallopt`. Chosen: some images of any camera that the parameters allow."""


class Diagnostics:
    """Publishes one status of a node on `/diagnostics`, once in 25 ticks (1 Hz at 25 Hz)."""

    def __init__(self, node: Node) -> None:
        """Make the publisher."""
        self._name = node.get_name()
        self._publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS, RELIABLE_QOS)
        self._ticks = 0

    def tick(
        self,
        stamp_ns: int,
        message: str,
        values: Callable[[], Mapping[str, object]],
        *,
        ok: bool = True,
    ) -> None:
        """Count a tick and publish where it is due.

        Args:
            stamp_ns: Stamp of the tick.
            message: One line for people.
            values: Called only where the status is published.
            ok: False for level WARN.
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
        self._publisher.publish(status_to_raw(status, stamp_ns))


def run_nodes(
    name: str, makers: Sequence[Callable[[], Node]], arguments: Sequence[str] | None = None
) -> int:
    """Be the `main` of an executable: serve nodes on one executor until SIGINT or SIGTERM.

    Signals only raise a flag that the loop looks at: rclpy's own handlers can strike in the
    middle of a callback and end in a traceback.

    Args:
        name: What runs, for lists of processes and for messages before a node exists.
        makers: Each constructs a node.
        arguments: Command line, or None for the process's own.

    Returns:
        Exit status: 0 after a clean end, 2 where the configuration was refused.
    """
    call_process(name)
    end_with_launcher()
    keep_freed_memory()
    stop = StopRequest()
    nodes: list[Node] = []
    try:
        _init(list(sys.argv if arguments is None else arguments))
        for make_node in makers:
            nodes.append(make_node())
            warn_of_unknown_parameters(nodes[-1])
        _spin(nodes, stop)
    except ConfigurationError as error:
        return _refuse(f'{name}: parameter {error}')
    except GoalreachError as error:
        return _refuse(f'{name}: {error}')
    finally:
        _deliver(nodes)
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _deliver(nodes: Sequence[Node]) -> None:
    """Wait a little until all who listen reliably have what was sent: the last word counts."""
    deadline_s = time.monotonic() + _DELIVERY_S
    for publisher in (publisher for node in nodes for publisher in node.publishers):
        left_s = deadline_s - time.monotonic()
        if left_s > 0.0:
            publisher.wait_for_all_acked(Duration(seconds=left_s))


def _spin(nodes: Sequence[Node], stop: StopRequest) -> None:
    executor = EventsExecutor()
    for node in nodes:
        executor.add_node(node)
    garbage = GarbageRounds(time.monotonic())
    try:
        while rclpy.ok() and not stop.requested:
            executor.spin_once(timeout_sec=_SPIN_S)
            garbage.look(time.monotonic())
    except ExternalShutdownException:
        pass
    finally:
        executor.shutdown()


class StopRequest:
    """Turns SIGINT and SIGTERM into a flag for a main loop to look at.

    Attributes:
        requested: Whether a signal has come.
    """

    def __init__(self) -> None:
        """Install the handlers."""
        self.requested = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.requested = True


def _init(arguments: list[str]) -> None:
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # rclpy's RCLError: the arguments after --ros-args are wrong
        reason = str(error).partition(': ')[2].partition(', at ')[0]
        raise GoalreachError(reason or str(error)) from None


def _refuse(line: str) -> int:
    sys.stderr.write(line.strip().splitlines()[0] + '\n')
    return _STATUS_BAD_CONFIGURATION


def keep_freed_memory() -> None:
    """Ask the allocator to keep freed blocks of the size of an image (glibc).

    By default it hands each back to the kernel, and the next image's pages come in anew, one
    fault each: that costs twenty times as much as copying the image.
    """
    if not sys.platform.startswith('linux'):
        return
    mallopt = getattr(ctypes.CDLL(None), 'mallopt', None)
    if mallopt is not None:
        mallopt(_M_MMAP_THRESHOLD, _LARGEST_KEPT_BYTES)
        mallopt(_M_TRIM_THRESHOLD, _MOST_KEPT_BYTES)


def call_process(name: str) -> None:
    """Give this process the name that `ps -C` and `top` show, its first 15 letters (Linux)."""
    if sys.platform.startswith('linux'):
        ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode())


def end_with_launcher() -> None:
    """Ask the kernel for SIGTERM when the launcher dies, however it dies (Linux)."""
    launcher = os.environ.get(LAUNCHER_PID)
    if launcher is None or not sys.platform.startswith('linux'):
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if str(os.getppid()) != launcher:
        raise SystemExit(0)
