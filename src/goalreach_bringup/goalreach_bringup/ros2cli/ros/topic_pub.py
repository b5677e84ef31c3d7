"""`ros2 topic pub`: publishes messages given on the command line."""

import argparse
from typing import Any, Final

from goalreach_bringup.ros2cli.arguments import (
    COUNT,
    SECONDS,
    TOPIC,
    add,
    add_values,
    positive_float,
    positive_int,
    values_text,
)
from goalreach_bringup.ros2cli.message_fields import build_message, parse_values
from goalreach_bringup.ros2cli.ros.qos import (
    add_qos_arguments,
    compatible_profile,
    profile_from_options,
)
from goalreach_bringup.ros2cli.ros.session import Session, add_verb
from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.interfaces import message_class

_WAITED: Final = 'Wait for N subscriptions (default: 1 with --once or --times, otherwise 0)'


def add_to(verbs: Any) -> None:
    """Add the verb to the sub-parsers of `ros2 topic`."""
    parser = add_verb(
        verbs,
        'pub',
        'Publish a message to a topic',
        publish,
        TOPIC,
        ('message_type', "Type (e.g. 'std_msgs/msg/String')"),
        ('-r --rate', 'Rate in Hz', {'metavar': 'N', 'type': positive_float, 'default': 1.0}),
        ('-p --print', 'Print every N-th', {**COUNT, 'default': 1}),
        ('-w --wait-matching-subscriptions', _WAITED, COUNT),
        ('--max-wait-time-secs', 'Longest such wait', SECONDS),
        ('--keep-alive', 'Stay after the last message', {**SECONDS, 'default': 0.1}),
        ('-n --node-name', 'Name of the created publishing node', {}),
    )
    add_values(parser, 'Values to fill the message with, in YAML')
    add(
        parser.add_mutually_exclusive_group(),
        ('-1 --once', 'Publish one message and exit'),
        ('-t --times', 'Publish N times and exit', {'metavar': 'N', 'type': positive_int}),
    )
    add_qos_arguments(parser, preset='default')


def publish(args: argparse.Namespace) -> None:
    """Publish one message, a number of them, or until it is interrupted.

    Raises:
        CommandError: The type or the values are wrong, or nobody subscribed in time.
    """
    kind = message_class(args.message_type)
    message, stampers = build_message(kind, parse_values(values_text(args)))
    profile = profile_from_options(args) or compatible_profile(args.qos_profile, [])[0]
    times = 1 if args.once else args.times
    with Session(args, args.node_name) as session:
        publisher = session.node.create_publisher(kind, args.topic_name, profile)
        _wait_for_subscriptions(session, publisher, args, 1 if times else 0)
        print('publisher: beginning loop', flush=True)
        published = 0

        def publish_once() -> None:
            nonlocal published
            for stamp in stampers:
                stamp(session.node.get_clock().now().to_msg())
            published += 1
            if args.print and published % args.print == 0:
                print(f'publishing #{published}: {message!r}\n', flush=True)
            publisher.publish(message)

        publish_once()
        timer = session.node.create_timer(1.0 / args.rate, publish_once)
        session.spin_until(lambda: times is not None and published >= times)
        timer.cancel()
        session.spin_until(lambda: False, args.keep_alive)


def _wait_for_subscriptions(
    session: Session, publisher: Any, args: argparse.Namespace, default: int
) -> None:
    wanted = args.wait_matching_subscriptions
    wanted = default if wanted is None else wanted
    left_s = float('inf') if args.max_wait_time_secs is None else args.max_wait_time_secs
    while publisher.get_subscription_count() < wanted:
        if left_s <= 0.0:
            raise CommandError(
                f'Timed out waiting for subscribers: Expected {wanted} subscribers '
                f'but only got {publisher.get_subscription_count()} subscribers'
            )
        print(f'Waiting for at least {wanted} matching subscription(s)...', flush=True)
        wait_s = min(1.0, left_s)
        session.spin_until(lambda: publisher.get_subscription_count() >= wanted, wait_s)
        left_s -= wait_s
