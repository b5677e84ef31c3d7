"""`ros2 node|service|topic list|info`: the names in the graph, and who is behind them."""

import argparse
import sys
from typing import Any

from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from goalreach_bringup.ros2cli.ros.session import Session, full_name
from goalreach_msgs_py.errors import CommandError


def list_names(args: argparse.Namespace) -> None:
    """Print the names of the topics or services."""
    with Session(args) as session:
        session.discover()
        found = session.topics() if args.noun == 'topic' else session.services()
    for name, types in found.items():
        if args.hidden or not topic_or_service_is_hidden(name):
            print(f'{name} [{", ".join(types)}]' if args.show_types else name)


def print_topic(args: argparse.Namespace) -> None:
    """Print the type of a topic, and how many nodes publish and subscribe."""
    with Session(args) as session:
        node, end = session.node, '\n\n' if args.verbose else '\n'
        name = node.resolve_topic_name(args.topic_name)
        if not session.discover(lambda: name in session.topics()):
            raise CommandError(f"Unknown topic '{args.topic_name}'")
        types = session.topics()[name]
        print(f'Type: {types[0] if len(types) == 1 else types}', end=end)
        publishers = node.get_publishers_info_by_topic(name)
        subscriptions = node.get_subscriptions_info_by_topic(name)
        for title, infos in (('Publisher', publishers), ('Subscription', subscriptions)):
            print(f'{title} count: {len(infos)}', end=end)
            for info in infos if args.verbose else ():
                print(info, end=end)


def list_nodes(args: argparse.Namespace) -> None:
    """Print the names of the nodes."""
    with Session(args) as session:
        session.discover()
        names = session.node_names(hidden=args.hidden)
    if len(set(names)) < len(names):
        print(
            'WARNING: Be aware that there are nodes in the graph that share an exact name, '
            'which can have unintended side effects.',
            file=sys.stderr,
        )
    print(''.join(f'{name}\n' for name in names), end='')


def print_node(args: argparse.Namespace) -> None:
    """Print the topics, services and actions of a node."""
    name = full_name(args.node_name)
    with Session(args) as session:
        if not session.discover(lambda: name in session.node_names(hidden=args.hidden)):
            raise CommandError(f"Unable to find node '{name}'")
        print(name)
        for title, found in _connections(session.node, name).items():
            shown = (one for one in found if args.hidden or not topic_or_service_is_hidden(one[0]))
            print(f'  {title}:')
            # As from ros2cli, an empty line where there is none.
            print('\n'.join(f'    {name}: {", ".join(types)}' for name, types in shown))


def _connections(node: Any, name: str) -> dict[str, list[tuple[str, list[str]]]]:
    """Return the names, and the types of each, that a node uses, by title."""
    namespace, _, base = name.rpartition('/')
    at = (base, namespace or '/')
    return {
        'Subscribers': node.get_subscriber_names_and_types_by_node(*at),
        'Publishers': node.get_publisher_names_and_types_by_node(*at),
        'Service Servers': node.get_service_names_and_types_by_node(*at),
        'Service Clients': node.get_client_names_and_types_by_node(*at),
        'Action Servers': get_action_server_names_and_types_by_node(node, *at),
        'Action Clients': get_action_client_names_and_types_by_node(node, *at),
    }
