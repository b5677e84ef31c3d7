"""`ros2 topic`: its verbs; lists topics and their endpoints."""

from __future__ import annotations

import argparse

from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from goalreach_bringup.ros2cli.ros import topic_echo as ros_topic_echo
from goalreach_bringup.ros2cli.ros import topic_hz as ros_topic_hz
from goalreach_bringup.ros2cli.ros import topic_pub as ros_topic_pub
from goalreach_bringup.ros2cli.ros.session import Session, add_session_arguments
from goalreach_msgs_py.errors import CommandError


def add_verbs(parser: argparse.ArgumentParser) -> None:
    """Add the verbs of `ros2 topic`."""
    parser.add_argument('--include-hidden-topics', action='store_true')
    verbs = parser.add_subparsers(title='Commands', metavar='VERB', required=True)
    _add_list(verbs.add_parser('list', help='Output a list of available topics'))
    verb = verbs.add_parser('info', help='Print information about a topic')
    add_session_arguments(verb)
    verb.add_argument('topic_name', help="Name of the ROS topic (e.g. '/chatter')")
    verb.add_argument(
        '-v',
        '--verbose',
        action='store_true',
        help='Print node name, type and QoS of each publisher and subscription',
    )
    verb.set_defaults(run=info_topic)
    ros_topic_echo.add_arguments(verbs.add_parser('echo', help='Output messages from a topic'))
    ros_topic_hz.add_arguments(
        verbs.add_parser('hz', help='Print the average receiving rate to screen')
    )
    ros_topic_pub.add_arguments(verbs.add_parser('pub', help='Publish a message to a topic'))


def _add_list(verb: argparse.ArgumentParser) -> None:
    add_session_arguments(verb)
    verb.add_argument(
        '-t', '--show-types', action='store_true', help='Additionally show the topic type'
    )
    verb.add_argument(
        '-c', '--count-topics', action='store_true', help='Only display the number of topics'
    )
    verb.add_argument(
        '--include-hidden-topics',
        action='store_true',
        default=argparse.SUPPRESS,
        help='Consider hidden topics as well',
    )
    verb.add_argument(
        '-v', '--verbose', action='store_true', help='List full details about each topic'
    )
    verb.set_defaults(run=list_topics)


def list_topics(args: argparse.Namespace) -> None:
    """Print the names of the topics."""
    with Session(args) as session:
        session.discover()
        topics = {
            name: types
            for name, types in session.topics().items()
            if args.include_hidden_topics or not topic_or_service_is_hidden(name)
        }
        if args.verbose and not args.count_topics:
            count = session.node.count_publishers
            _print_counts('Published', 'publisher', topics, {n: count(n) for n in topics})
            count = session.node.count_subscribers
            _print_counts('Subscribed', 'subscriber', topics, {n: count(n) for n in topics})
            return
    if args.count_topics:
        print(len(topics))
        return
    for name, types in topics.items():
        print(f'{name} [{", ".join(types)}]' if args.show_types else name)


def _print_counts(
    title: str, noun: str, topics: dict[str, list[str]], counts: dict[str, int]
) -> None:
    print(f'{title} topics:')
    for name, types in topics.items():
        if counts[name]:
            plural = '' if counts[name] == 1 else 's'
            print(f' * {name} [{", ".join(types)}] {counts[name]} {noun}{plural}')
    print()


def info_topic(args: argparse.Namespace) -> None:
    """Print the type of a topic and who publishes and subscribes to it.

    Raises:
        CommandError: There is no such topic.
    """
    with Session(args) as session:
        node = session.node
        name = node.resolve_topic_name(args.topic_name)
        if not session.discover(lambda: name in session.topics()):
            raise CommandError(f"Unknown topic '{args.topic_name}'")
        types = session.topics()[name]
        end = '\n\n' if args.verbose else '\n'
        print(f'Type: {types[0] if len(types) == 1 else types}', end=end)
        print(f'Publisher count: {node.count_publishers(name)}', end=end)
        if args.verbose:
            for info in node.get_publishers_info_by_topic(name):
                print(info, end=end)
        print(f'Subscription count: {node.count_subscribers(name)}', end=end)
        if args.verbose:
            for info in node.get_subscriptions_info_by_topic(name):
                print(info, end=end)
