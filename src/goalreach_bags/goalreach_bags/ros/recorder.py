"""The recorder: writes every message of the selected topics into a bag, unchanged."""

from collections.abc import Callable
from dataclasses import dataclass
import json
import math
from pathlib import Path
import time
from typing import Final

from rclpy.node import Node
from rich.console import Console
from rich.status import Status

from goalreach_bags import recording
from goalreach_bags.decode import erase_padding
from goalreach_bags.options import RecordOptions
from goalreach_bags.ros.qos_profiles import bag_topic
from goalreach_bags.ros.subscriptions import GraphSubscriptions, ReceivedMessage, TopicSubscription
from goalreach_bags.storage import BagStoppedError
from goalreach_bags.tick_order import TickOrder
from goalreach_bags.writer import BagWriter
from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.ros.acknowledgement import Acknowledger
from goalreach_msgs_py.ros.dds_profile import DISCOVERY_PROFILE
from goalreach_msgs_py.ros.node import ros_session
from goalreach_msgs_py.ros.process import StopRequest, terminate_with_launcher
from goalreach_msgs_py.topics import CLOCK, GROUND_TRUTH, RECORDER

_LOCKSTEP_POLL_S: Final = 0.001
_POLL_S: Final = 0.004
"""Chosen: in lockstep the graph waits for the recorder, in real time nothing does."""

_DISCOVER_S: Final = 0.1
_DECIDE_S: Final = 1.0
"""Time after the first message during which messages are held back until the graph turns out to
have a clock or not."""
_CLOCK_S: Final = 10.0
"""The same where a clock is expected or known: the simulator of a run may start late."""

_QUIET_S: Final = 0.3
_DRAIN_S: Final = 3.0
"""At the end, recording stops after this time without a message, or after this time. Chosen."""


@dataclass
class _Run:
    """A run that the recorder belongs to.

    Attributes:
        prefix: Its namespace, with which the names of its topics begin; or empty.
        topics: Those of its topics that are recorded, but a clock of another namespace.
        order: Order of its messages, in lockstep.
        acknowledger: Registered with its simulator; None before.
        acknowledged_ns: Its last tick that was acknowledged.
    """

    prefix: str
    topics: list[str]
    order: TickOrder
    acknowledger: Acknowledger | None = None
    acknowledged_ns: int | None = None


class Recorder(Node):
    """Records the selected topics into a bag.

    Subscribes to the selected topics, unparsed. Publishes, where it belongs to a run,
    acknowledgements of the ticks received whole (see `Acknowledger`).

    Attributes:
        stopped: Why the recording ended early, or empty.
    """

    def __init__(self, options: RecordOptions) -> None:
        namespace = options.robots[0] if len(options.robots) == 1 else None
        quiet = {'start_parameter_services': False, 'enable_rosout': False}
        super().__init__(RECORDER, namespace=namespace, **quiet)
        self._options = options
        self._path = options.bag or Path(time.strftime('goalreach-%Y-%m-%d-%H-%M-%S'))
        self._writer = BagWriter(self._path, options.storage)
        if options.parameters:
            self._writer.custom[recording.PARAMETERS_KEY] = options.parameters
        self._inputs = GraphSubscriptions(self, options.selection, options.clock_topic)
        self._clock_ns: int | None = None
        robots = options.robots or (('',) if options.with_run else ())
        self._runs = [self._expect_run(f'/{robot}' if robot else '') for robot in robots]
        self._in_order = bool(self._runs) and options.with_run != 'realtime'
        asked = bool(self._runs) or options.use_sim_time
        self._sim_time = True if self._in_order else None if asked else options.use_sim_time
        self._patience_s = _CLOCK_S if asked else _DECIDE_S
        self._held: list[ReceivedMessage] = []
        self._draining = False
        self.stopped = ''
        self._began_s = self._discovered_s = self._heard_s = time.monotonic()

    def _expect_run(self, prefix: str) -> _Run:
        self._inputs.expect({prefix + name: kind for name, kind in recording.OUTPUT_TYPES.items()})
        names = [prefix + name for name in recording.RUN_TOPICS if name != CLOCK or not prefix]
        recorded = [name for name in names if self._inputs.records(name)]
        ticks = [name for name in recorded if name.removeprefix(prefix) in recording.TICK_TOPICS]
        unstamped = [prefix + name for name in recording.UNSTAMPED]
        return _Run(prefix, recorded, TickOrder(ticks, unstamped))

    def record(self, is_over: Callable[[], bool], watch: Callable[[str], None]) -> str:
        """Record until it is over, drain messages on their way, and close the bag.

        `watch` gets a line of progress ten times a second.
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
        return quiet and (not self._in_order or all(run.order.complete for run in self._runs))

    def _poll(self, watch: Callable[[str], None]) -> None:
        """Take the messages that have arrived, or wait a moment."""
        now_s = time.monotonic()
        if now_s - self._discovered_s >= _DISCOVER_S:
            self._discovered_s = now_s
            self._inputs.discover()
            self._decide_clock(now_s)
            self._register()
            self._guard(self._writer.flush_if_due)
            size_mb, lost = self._writer.size / 1e6, sum(self._inputs.lost().values())
            count = f'{self._writer.message_count} messages of {len(self._writer.topics)} topics'
            watch(f'{count}, {size_mb:.1f} MB, {lost} lost')
        for message in self._inputs.take():
            self._heard_s = now_s
            self._accept(message)
        if self._heard_s != now_s:
            time.sleep(_LOCKSTEP_POLL_S if self._in_order else _POLL_S)

    def _register(self) -> None:
        """Register with the simulator of each run, once every topic is connected."""
        for run in self._runs:
            if self._in_order and not run.order.required:
                continue  # no tick is ever received whole
            if run.acknowledger is None and self._inputs.all_connected(run.topics):
                run.acknowledger = Acknowledger(self, window_ticks=1, namespace=run.prefix)

    def _decide_clock(self, now_s: float) -> None:
        has_clock = self._options.clock_topic in self._inputs.by_name
        patience_s = _CLOCK_S if has_clock else self._patience_s
        if self._sim_time is None and self._held and now_s - self._began_s >= patience_s:
            self._sim_time = has_clock and bool(self._runs)  # else it may be silent for ever
            if not self._sim_time:
                self._release()

    def _accept(self, message: ReceivedMessage) -> None:
        if self._in_order:
            self._accept_in_order(*message[:2])
            return
        if message[0].name == self._options.clock_topic:
            self._clock_ns = stamp_of(message[1])
            self._sim_time = self._sim_time is not False
        if not self._held:
            self._began_s = time.monotonic()
        self._held.append(message)
        if self._sim_time is False or (self._sim_time and self._clock_ns is not None):
            self._release()

    def _release(self) -> None:
        """Write the messages held back, at the time of the clock if there is one."""
        held, self._held = self._held, []
        for source, data, info in held:
            if self._sim_time and self._clock_ns is not None:
                self._write(source.name, self._clock_ns, data)
            else:
                self._write(
                    source.name, info['received_timestamp'], data, info['source_timestamp']
                )

    def _accept_in_order(self, source: TopicSubscription, data: bytes) -> None:
        of_run = (run for run in self._runs if source.name.startswith(f'{run.prefix}/'))
        run = next(of_run, self._runs[0])
        order = run.order
        stamp_ns = stamp_of(data) if source.stamped else None
        order.add(source.name, stamp_ns, erase_padding(source.type_name, data))
        for settled in order.settled():
            self._write(settled.topic, settled.time_ns, settled.data)
        if order.complete and order.stamp_ns is not None:
            repeated = source.name == run.prefix + GROUND_TRUTH  # by the simulator
            due = order.stamp_ns != run.acknowledged_ns or repeated
            if run.acknowledger and due and not self._draining:  # then the run stands still
                run.acknowledged_ns = order.stamp_ns
                run.acknowledger.acknowledge(order.stamp_ns)

    def _write(
        self, name: str, time_ns: int, data: bytes, published_ns: int | None = None
    ) -> None:
        if self._inputs.records(name):
            self._add_topic(name)
            self._guard(lambda: self._writer.write(name, time_ns, data, published_ns))

    def _add_topic(self, name: str) -> None:
        if name not in self._writer.topics:
            type_name = self._inputs.by_name[name].type_name
            self._guard(lambda: self._writer.add_topic(bag_topic(self, name, type_name)))

    def _guard(self, action: Callable[[], object]) -> None:
        """Act on the bag unless the disk has failed, which is logged once; the graph continues."""
        if self.stopped:
            return
        try:
            action()
        except BagStoppedError as error:
            self.stopped = str(error)
            self.get_logger().error(self.stopped)

    def _close(self) -> str:
        for run in self._runs:
            for message in run.order.rest():
                self._write(message.topic, message.time_ns, message.data)
        self._sim_time = bool(self._sim_time)
        self._release()
        for name in filter(self._inputs.records, self._inputs.by_name):
            self._add_topic(name)
        clock, lost = 'sim' if self._sim_time else 'wall', self._inputs.lost()
        self._writer.custom |= {recording.LOST_KEY: json.dumps(lost), recording.CLOCK_KEY: clock}
        self._guard(self._writer.close)
        total = self._writer.metadata().total
        losses = ', '.join(f'{count} of {name}' for name, count in sorted(lost.items()))
        return (
            f'recorded {total.message_count} messages of {len(total.counts)} topics, '
            f'{total.duration_ns * 1e-9:.1f} s, {self._writer.size / 1e6:.1f} MB, lost '
            f'{losses or "none"}{", stopped early" if self.stopped else ""}: {self._path}'
        )


def record(options: RecordOptions) -> tuple[str, bool]:
    """Record until a signal or the end of the time; return a line, and whether it is whole."""
    terminate_with_launcher()
    stop = StopRequest()
    end_s = time.monotonic() + (options.duration or math.inf)
    console = Console(stderr=True)
    status = Status('recording', console=console)
    with ros_session(profile=DISCOVERY_PROFILE) as closing:
        closing.callback(status.stop)
        if console.is_terminal:
            status.start()
        recorder = Recorder(options)
        closing.callback(recorder.destroy_node)
        line = recorder.record(lambda: stop.requested or time.monotonic() >= end_s, status.update)
        return line, not recorder.stopped
