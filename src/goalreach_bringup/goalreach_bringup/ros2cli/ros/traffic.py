"""`ros2 topic echo|hz|pub` and `ros2 service call`: the messages of a topic or a service."""

import argparse
from collections import deque
from copy import copy
import re
import statistics
from typing import Any, Final

from rclpy.event_handler import SubscriptionEventCallbacks

from goalreach_bringup.ros2cli.messages import build_message, message_to_yaml, parse_values
from goalreach_bringup.ros2cli.ros.session import Session
from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.interfaces import full_type_name, message_class, service_class
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, SENSOR_QOS, meet_all

_INDEX: Final = re.compile(r'\[(-?\d+)\]$')
_NS: Final = 1e-9
_REPORT_NS: Final = 1_000_000_000
_KEEP_ALIVE_S: Final = 0.1
"""Time in which the last message is sent, as in ros2cli."""


def echo(args: argparse.Namespace) -> None:
    """Print the messages of a topic as they arrive."""
    path = [name for name in (args.field or '').split('.') if name]
    if args.field is not None and not path:
        raise CommandError(f"Invalid field value '{args.field}'")
    with Session(args) as session:
        node = session.node
        topic = node.resolve_topic_name(args.topic_name)
        session.discover(lambda: bool(node.count_publishers(topic)))
        profile = copy(SENSOR_QOS)
        for note in meet_all(profile, node.get_publishers_info_by_topic(topic)):
            print(note)
        printed = False

        def on_message(message: Any) -> None:
            nonlocal printed
            value, most = _select(message, path), args.truncate_length
            if hasattr(value, 'get_fields_and_field_types'):
                most = None if args.full_length else most
                value = message_to_yaml(value, most, arrays=not args.no_arr).rstrip('\n')
            print(f'{value}\n---', flush=True)
            printed = True

        node.create_subscription(
            message_class(args.message_type or _topic_type(session, topic)),
            topic,
            on_message,
            profile,
            event_callbacks=SubscriptionEventCallbacks(message_lost=_on_lost),
        )
        session.spin_until(lambda: args.once and printed)


def _topic_type(session: Session, topic: str) -> str:
    """Return the one type of a topic; refuse one that is not there, or that has several."""
    types = session.topics().get(topic, [])
    if not types:
        print(f'WARNING: topic [{topic}] does not appear to be published yet')
        raise CommandError('Could not determine the type for the passed topic')
    if len(types) > 1:
        raise CommandError(
            f"Cannot echo topic '{topic}', as it contains more than one type: [{', '.join(types)}]"
        )
    return types[0]


def _select(message: Any, path: list[str]) -> Any:
    value = message
    try:
        for name in path:
            index = _INDEX.match(name)
            value = value[int(index[1])] if index else getattr(value, name)
    except (AttributeError, IndexError, TypeError) as error:
        raise CommandError(f"Invalid field '{'.'.join(path)}': {error}") from None
    return value


def _on_lost(status: Any) -> None:
    print(
        'A message was lost!!!\n'
        f'\ttotal count change:{status.total_count_change}\n'
        f'\ttotal count: {status.total_count}---',
        flush=True,
    )


class ArrivalRate:
    """Collects the last intervals between arrivals, as many as the window holds."""

    def __init__(self, window: int) -> None:
        self._intervals_ns: deque[int] = deque(maxlen=window)
        self._last_ns: int | None = None

    def add(self, now_ns: int) -> None:
        """Add an arrival; the first one, and one before the last, clear the window."""
        if self._last_ns is None or now_ns < self._last_ns:
            self._intervals_ns.clear()
        else:
            self._intervals_ns.append(now_ns - self._last_ns)
        self._last_ns = now_ns

    def __str__(self) -> str:
        """Return the two lines of `ros2 topic hz`; empty before the second arrival."""
        if not self._intervals_ns:
            return ''
        times_s = [interval_ns * _NS for interval_ns in self._intervals_ns]
        mean_s = statistics.fmean(times_s)
        return (
            f'average rate: {1.0 / mean_s if mean_s else 0.0:.3f}\n'
            f'\tmin: {min(times_s):.3f}s max: {max(times_s):.3f}s '
            f'std dev: {statistics.pstdev(times_s):.5f}s window: {len(times_s)}'
        )


def measure_rate(args: argparse.Namespace) -> None:
    """Print the rate of the messages of a topic about once a second; wait without limit for it."""
    with Session(args) as session:
        clock, topic = session.node.get_clock(), session.node.resolve_topic_name(args.topic_name)
        if not session.spin_until(lambda: topic in session.topics(), session.spin_time_s):
            print(f'WARNING: topic [{topic}] does not appear to be published yet', flush=True)
            session.spin_until(lambda: topic in session.topics())
        rate, reported_ns = ArrivalRate(args.window), 0

        def on_message(_: bytes) -> None:
            nonlocal reported_ns
            if not (now_ns := clock.now().nanoseconds):  # no simulated time yet
                return
            rate.add(now_ns)
            if not reported_ns <= now_ns < reported_ns + _REPORT_NS:
                if text := str(rate):
                    print(text, flush=True)
                reported_ns = now_ns

        kind = message_class(_topic_type(session, topic))
        session.node.create_subscription(kind, topic, on_message, SENSOR_QOS, raw=True)
        session.spin_until(lambda: False)


def publish(args: argparse.Namespace) -> None:
    """Publish one message, a number of them, or until it is interrupted."""
    kind = message_class(args.message_type)
    message, stampers = build_message(kind, parse_values(args.values))
    times = 1 if args.once else args.times
    with Session(args) as session:
        publisher = session.node.create_publisher(kind, args.topic_name, RELIABLE_QOS)
        given = args.wait_matching_subscriptions
        wanted = (1 if times else 0) if given is None else given
        while not session.spin_until(lambda: publisher.get_subscription_count() >= wanted, 1.0):
            print(f'Waiting for at least {wanted} matching subscription(s)...', flush=True)
        print('publisher: beginning loop', flush=True)
        published = 0

        def publish_once() -> None:
            nonlocal published
            for stamp in stampers:
                stamp(session.node.get_clock().now().to_msg())
            published += 1
            print(f'publishing #{published}: {message!r}\n', flush=True)
            publisher.publish(message)

        publish_once()
        timer = session.node.create_timer(1.0 / args.rate, publish_once)
        session.spin_until(lambda: times is not None and published >= times)
        timer.cancel()
        session.spin_until(lambda: False, _KEEP_ALIVE_S)


def call_service(args: argparse.Namespace) -> None:
    """Call a service, and print request and response."""
    service = service_class(args.service_type)
    request, stampers = build_message(service.Request, parse_values(args.values))
    with Session(args) as session:
        print('waiting for service to become available...', flush=True)
        name = session.node.resolve_service_name(args.service_name)
        session.spin_until(lambda: name in session.services(), session.spin_time_s)
        offered = session.services().get(name, [])
        wanted = full_type_name(args.service_type, 'srv')
        if offered and wanted not in offered:
            raise CommandError(
                f"The service '{name}' has the type '{', '.join(offered)}', not '{wanted}'"
            )
        client = session.node.create_client(service, name)
        session.spin_until(client.service_is_ready)
        for stamp in stampers:
            stamp(session.node.get_clock().now().to_msg())
        print(f'requester: making request: {request!r}\n', flush=True)
        future = client.call_async(request)
        response = session.result(future)
        print(f'response:\n{response!r}\n', flush=True)
