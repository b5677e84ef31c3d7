"""The recorder: writes every message of the selected topics into a bag, unchanged."""

from collections.abc import Callable
from pathlib import Path
import time
from typing import Final

from rclpy.node import Node
from rich.console import Console
from rich.status import Status

from goalreach_bags.decode import PaddingEraser
from goalreach_bags.options import RecordOptions
from goalreach_bags.recording import (
    PARAMETERS_KEY,
    RUN_TOPICS,
    TICK_TOPICS,
    RecordingResult,
    recording_texts,
)
from goalreach_bags.ros.subscriptions import GraphSubscriptions, ReceivedMessage
from goalreach_bags.storage import BagStoppedError
from goalreach_bags.tick_order import TickOrder
from goalreach_bags.writer import BagWriter
from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.ros.acknowledgement import Acknowledger
from goalreach_msgs_py.ros.dds_profile import DISCOVERY_PROFILE
from goalreach_msgs_py.ros.node import ros_session
from goalreach_msgs_py.ros.process import StopRequest, terminate_with_launcher
from goalreach_msgs_py.topics import CLOCK, RECORDER

_LOCKSTEP_POLL_S: Final = 0.001
_POLL_S: Final = 0.004
"""Chosen: in lockstep the graph waits for the recorder, in real time nothing does."""

_DISCOVER_S: Final = 0.1
_DECIDE_S: Final = 1.0
"""Time after the first message during which messages are held back until the graph turns out to
have a clock or not."""

_QUIET_S: Final = 0.3
_DRAIN_S: Final = 3.0
"""At the end, recording stops after this time without a message, or after this time. Chosen."""


class Recorder(Node):
    """Records the selected topics into a bag.

    Subscribes to the selected topics, unparsed. Publishes, where it belongs to a run,
    acknowledgements of the ticks received whole (see `Acknowledger`).

    Args:
        options: What to record, where and how.

    Raises:
        BagError: The bag cannot be made.
    """

    def __init__(self, options: RecordOptions) -> None:
        super().__init__(RECORDER, start_parameter_services=False, enable_rosout=False)
        self._options = options
        self._path = options.bag or Path(time.strftime('goalreach-%Y-%m-%d-%H-%M-%S'))
        self._writer = BagWriter(self._path, options.storage)
        if options.parameters:
            self._writer.custom[PARAMETERS_KEY] = options.parameters
        self._inputs = GraphSubscriptions(self, options.selection)
        self._counts: dict[str, int] = {}
        self._clock_ns: int | None = None
        self._sim_time = options.with_run is not None or options.use_sim_time
        self._held: list[ReceivedMessage] = []
        self._order = TickOrder(TICK_TOPICS) if options.with_run == 'lockstep' else None
        self._acknowledger: Acknowledger | None = None
        self._acknowledged_ns: int | None = None
        self._draining = False
        self._padding = PaddingEraser()
        self._stopped = ''
        self._began_s = self._discovered_s = self._heard_s = time.monotonic()

    def record(self, is_over: Callable[[], bool], watch: Callable[[str], None]) -> RecordingResult:
        """Record until it is over, drain messages on their way, and close the bag.

        Args:
            is_over: Returns whether to end; called many times a second.
            watch: Called ten times a second with a line of progress.
        """
        while not is_over():
            self._poll(watch)
        self._draining = True
        drain_s = time.monotonic()
        while time.monotonic() - drain_s < _DRAIN_S and not self._is_quiet():
            self._poll(watch)
        return self._close()

    def _is_quiet(self) -> bool:
        quiet = time.monotonic() - self._heard_s > _QUIET_S
        return quiet and (self._order is None or self._order.complete)

    def _poll(self, watch: Callable[[str], None]) -> None:
        """Take the messages that have arrived, or wait a moment."""
        now_s = time.monotonic()
        if now_s - self._discovered_s >= _DISCOVER_S:
            self._discovered_s = now_s
            self._inputs.discover()
            self._decide_clock(now_s)
            self._register()
            self._guard(self._writer.flush_if_due)
            watch(self._progress())
        heard = False
        for message in self._inputs.take():
            heard = True
            self._accept(message)
        if heard:
            self._heard_s = now_s
        else:
            time.sleep(_POLL_S if self._order is None else _LOCKSTEP_POLL_S)

    def _register(self) -> None:
        """Register with the simulator of the run, once every topic is connected."""
        if self._options.with_run and self._acknowledger is None:
            wanted = [name for name in RUN_TOPICS if self._inputs.records(name)]
            if self._inputs.all_connected(wanted):
                self._acknowledger = Acknowledger(self, window_ticks=1)

    def _acknowledge(self, stamp_ns: int, *, again: bool) -> None:
        """Acknowledge a tick received whole; while draining none, so that the run stands still.

        Args:
            stamp_ns: The tick.
            again: Whether to repeat an acknowledgement, since the simulator repeats the tick.
        """
        if self._acknowledger is None or self._draining:
            return
        if stamp_ns != self._acknowledged_ns or again:
            self._acknowledged_ns = stamp_ns
            self._acknowledger.acknowledge(stamp_ns)

    def _decide_clock(self, now_s: float) -> None:
        if self._sim_time is None and self._held and now_s - self._began_s >= _DECIDE_S:
            self._sim_time = self._inputs.has_clock()
            if not self._sim_time:
                self._release()

    def _accept(self, message: ReceivedMessage) -> None:
        if self._order is not None:
            self._accept_in_order(message, self._order)
            return
        if message.topic == CLOCK:
            self._clock_ns = stamp_of(message.data)
            self._sim_time = self._sim_time is not False
        if not self._held:
            self._began_s = time.monotonic()
        self._held.append(message)
        if self._sim_time is False or (self._sim_time and self._clock_ns is not None):
            self._release()

    def _release(self) -> None:
        """Write the messages held back, at the time of the clock if there is one."""
        held, self._held = self._held, []
        for message in held:
            if self._sim_time and self._clock_ns is not None:
                self._write(message.topic, self._clock_ns, message.data)
            else:
                self._write(message.topic, message.received_ns, message.data, message.published_ns)

    def _accept_in_order(self, message: ReceivedMessage, order: TickOrder) -> None:
        stamp_ns = stamp_of(message.data) if message.stamped else None
        order.add(message.topic, stamp_ns, self._padding.erase(message.type_name, message.data))
        if order.complete and order.stamp_ns is not None:
            for settled in order.settled():
                self._write(settled.topic, settled.time_ns, settled.data)
            self._acknowledge(order.stamp_ns, again=message.topic == CLOCK)

    def _write(
        self, name: str, time_ns: int, data: bytes, published_ns: int | None = None
    ) -> None:
        if self._stopped or not self._inputs.records(name):
            return
        self._add_topic(name)
        self._guard(lambda: self._writer.write(name, time_ns, data, published_ns))
        if not self._stopped:
            self._counts[name] += 1

    def _add_topic(self, name: str) -> None:
        if name not in self._counts:
            self._counts[name] = 0
            self._guard(lambda: self._writer.add_topic(self._inputs.describe(name)))

    def _guard(self, action: Callable[[], object]) -> None:
        """Act on the bag unless the disk has failed, which is logged once; the graph continues."""
        if self._stopped:
            return
        try:
            action()
        except BagStoppedError as error:
            self._stopped = str(error)
            self.get_logger().error(self._stopped)

    def _progress(self) -> str:
        lost = sum(self._inputs.lost().values())
        return (
            f'{sum(self._counts.values())} messages of {len(self._counts)} topics, '
            f'{self._writer.size / 1e6:.1f} MB, {lost} lost'
        )

    def _close(self) -> RecordingResult:
        if self._order is not None:
            for message in self._order.rest():
                self._write(message.topic, message.time_ns, message.data)
        self._sim_time = bool(self._sim_time)
        self._release()
        for name in self._inputs.names():
            self._add_topic(name)
        custom = recording_texts(self._inputs.lost(), sim_time=self._sim_time)
        self._guard(lambda: self._writer.close(custom))
        total = self._writer.metadata().total
        return RecordingResult(
            path=self._path,
            counts=total.counts,
            lost=self._inputs.lost(),
            duration_s=total.duration_ns * 1e-9,
            size_bytes=self._writer.size,
            stopped=self._stopped,
        )


def record(options: RecordOptions) -> RecordingResult:
    """Record until SIGINT or SIGTERM, or until the time is over.

    Raises:
        BagError: The bag cannot be made.
    """
    terminate_with_launcher()
    stop = StopRequest()
    began_s = time.monotonic()

    def is_over() -> bool:
        limit_s = options.duration
        return stop.requested or (limit_s is not None and time.monotonic() - began_s >= limit_s)

    console = Console(stderr=True)
    status = Status('recording', console=console)
    with ros_session(DISCOVERY_PROFILE) as closing:
        closing.callback(status.stop)
        if console.is_terminal:
            status.start()
        recorder = Recorder(options)
        closing.callback(recorder.destroy_node)
        return recorder.record(is_over, status.update)
