"""`ros2 topic hz`, `bw` and `delay`: rate, bandwidth and delay of the messages of a topic."""

import argparse
import time
from typing import Any, Final

from rclpy.clock import Clock, ClockType
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time

from goalreach_bringup.ros2cli.arguments import FILTER, TOPIC, add, positive_int
from goalreach_bringup.ros2cli.rate import Bandwidth, TimeWindow
from goalreach_bringup.ros2cli.ros.session import Session, add_verb
from goalreach_bringup.ros2cli.ros.topic_echo import topic_type
from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.interfaces import message_class

_REPORT_NS: Final = 1_000_000_000


def add_verbs(verbs: Any) -> None:
    """Add the verbs to the sub-parsers of `ros2 topic`."""
    for name, text, meter, window in (
        ('hz', 'Print the average receiving rate to screen', _TimeMeter, 10000),
        ('bw', 'Display bandwidth used by topic', _BandwidthMeter, 100),
        ('delay', 'Display delay of topic from timestamp in header', _TimeMeter, 10000),
    ):
        size = 'window size, in # of messages, for the calculation (default: %(default)s)'
        count = ('-w --window', size, {'metavar': 'N', 'type': positive_int, 'default': window})
        verb = add_verb(verbs, name, text, measure, TOPIC, count)
        verb.set_defaults(meter=meter, delays=name == 'delay')
    add(
        verbs.choices['hz'],
        ('--filter', 'Count if this Python expression of m, the message, is true', FILTER),
        ('--wall-time', 'calculate the rate with wall time'),
    )


def measure(args: argparse.Namespace) -> None:
    """Print a figure about the messages of a topic about once a second.

    Waits for the topic without a limit. Messages are deserialized only where that is needed.

    Raises:
        CommandError: The type of the topic is not known here, or has no header.
    """
    with Session(args) as session:
        topic = session.node.resolve_topic_name(args.topic_name)
        if not session.spin_until(lambda: topic in session.topics(), session.spin_time_s):
            print(f'WARNING: topic [{topic}] does not appear to be published yet', flush=True)
            session.spin_until(lambda: topic in session.topics())
        meter = args.meter(session.node, args)
        kind = message_class(topic_type(session, topic))
        session.node.create_subscription(
            kind, topic, meter.on_message, qos_profile_sensor_data, raw=meter.raw
        )
        session.spin_until(lambda: False)


class _TimeMeter:
    """Prints the rate of arrivals as they come, or once a second their delay."""

    def __init__(self, node: Any, args: argparse.Namespace) -> None:
        wall, self._passes = getattr(args, 'wall_time', False), getattr(args, 'filter', None)
        self._delays = args.delays
        self.raw = not self._delays and self._passes is None
        self._clock = Clock(clock_type=ClockType.SYSTEM_TIME) if wall else node.get_clock()
        self._window = TimeWindow(args.window, delays=args.delays)
        self._reported_ns: int | None = None
        self._new = False
        if self._delays:
            node.create_timer(1.0, self._report)

    def on_message(self, message: Any) -> None:
        """Count an arrival."""
        if self._delays and not hasattr(message, 'header'):
            raise CommandError('msg does not have header')
        now_ns = self._clock.now().nanoseconds
        if now_ns == 0 or (self._passes and not self._passes(message)):  # 0: no simulated time yet
            return
        stamp_ns = Time.from_msg(message.header.stamp).nanoseconds if self._delays else 0
        self._window.add(now_ns, stamp_ns)
        self._new = True
        if self._reported_ns is None or now_ns < self._reported_ns:
            self._reported_ns = now_ns
        elif not self._delays and now_ns >= self._reported_ns + _REPORT_NS:
            self._reported_ns = now_ns
            self._report()

    def _report(self) -> None:
        if text := str(self._window):
            print(text if self._new else 'no new messages', flush=True)
        self._new = False


class _BandwidthMeter:
    """Prints the bandwidth once a second."""

    raw = True

    def __init__(self, node: Any, args: argparse.Namespace) -> None:
        self._clock = node.get_clock() if args.use_sim_time else None
        self._bandwidth = Bandwidth(args.window)
        node.create_timer(1.0, self._report)
        print(f'Subscribed to [{args.topic_name}]', flush=True)

    def _now_s(self) -> float:
        if self._clock is None:
            return time.monotonic()
        return float(self._clock.now().nanoseconds * 1e-9)

    def on_message(self, data: bytes) -> None:
        """Count an arrival."""
        self._bandwidth.add(self._now_s(), len(data))

    def _report(self) -> None:
        if text := self._bandwidth.text(self._now_s()):
            print(text, flush=True)
