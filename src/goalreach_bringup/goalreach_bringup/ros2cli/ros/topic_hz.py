"""`ros2 topic hz`: rate of the messages of a topic."""

from __future__ import annotations

import argparse
from typing import Final

from rclpy.clock import Clock, ClockType
from rclpy.qos import qos_profile_sensor_data

from goalreach_bringup.ros2cli.arguments import positive_int
from goalreach_bringup.ros2cli.rate import ArrivalRate
from goalreach_bringup.ros2cli.ros.session import Session, add_session_arguments
from goalreach_bringup.ros2cli.ros.topic_echo import topic_type
from goalreach_msgs_py.ros.interfaces import message_class

_REPORT_NS: Final = 1_000_000_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `ros2 topic hz`."""
    add_session_arguments(parser)
    parser.add_argument('topic_name', help="Name of the ROS topic (e.g. '/chatter')")
    parser.add_argument(
        '-w',
        '--window',
        type=positive_int,
        default=10000,
        help='window size, in # of messages, for calculating rate (default: %(default)s)',
    )
    parser.add_argument(
        '--wall-time', action='store_true', help='calculate the rate with wall time'
    )
    parser.set_defaults(run=measure_rate)


def measure_rate(args: argparse.Namespace) -> None:
    """Print the rate of the messages of a topic about once a second.

    Waits for the topic without a limit. Messages are counted without being deserialized.

    Raises:
        CommandError: The type of the topic is not known here.
    """
    with Session(args) as session:
        topic = session.node.resolve_topic_name(args.topic_name)
        if not session.find(lambda: topic in session.topics()):
            print(f'WARNING: topic [{topic}] does not appear to be published yet', flush=True)
            session.spin_until(lambda: topic in session.topics())
        clock = session.node.get_clock()
        if args.wall_time:
            clock = Clock(clock_type=ClockType.SYSTEM_TIME)
        monitor = _Monitor(clock, args.window)
        session.node.create_subscription(
            message_class(topic_type(session, topic)),
            topic,
            monitor.on_message,
            qos_profile_sensor_data,
            raw=True,
        )
        session.spin_until(lambda: False)


class _Monitor:
    """Prints the rate of arrivals once a second."""

    def __init__(self, clock: Clock, window: int) -> None:
        self._clock = clock
        self._rate = ArrivalRate(window)
        self._reported_ns: int | None = None

    def on_message(self, _: bytes) -> None:
        """Count an arrival."""
        now_ns = self._clock.now().nanoseconds
        if now_ns == 0:  # simulated time that has not started
            return
        self._rate.add(now_ns)
        if self._reported_ns is None or now_ns < self._reported_ns:
            self._reported_ns = now_ns
        elif now_ns >= self._reported_ns + _REPORT_NS:
            self._reported_ns = now_ns
            print(self._rate.summary(), flush=True)
