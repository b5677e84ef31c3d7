"""`ros2 node`: lists nodes and their connections."""

import argparse
import sys
from typing import Any

from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)

from goalreach_bringup.ros2cli.ros.session import Session, add_verb, full_name
from goalreach_msgs_py.errors import CommandError


def add_verbs(parser: argparse.ArgumentParser) -> None:
    """Add the verbs of `ros2 node`."""
    verbs = parser.add_subparsers(title='Commands', metavar='VERB', required=True)
    hidden = ('-a --all', 'Display hidden nodes too')
    count = ('-c --count-nodes', 'Only display the number of nodes')
    add_verb(verbs, 'list', 'Output a list of available nodes', list_nodes, hidden, count)
    name = ('node_name', 'Fully qualified node name')
    hidden = ('--include-hidden', 'Display hidden topics and services too')
    add_verb(verbs, 'info', 'Output information about a node', info_nodes, name, hidden)


def list_nodes(args: argparse.Namespace) -> None:
    """Print the names of the nodes."""
    with Session(args) as session:
        session.discover()
        names = session.node_names(hidden=args.all)
    if args.count_nodes:
        print(len(names))
        return
    if len(set(names)) < len(names):
        print(
            'WARNING: Be aware that there are nodes in the graph that share an exact name, '
            'which can have unintended side effects.',
            file=sys.stderr,
        )
    for name in names:
        print(name)


def info_nodes(args: argparse.Namespace) -> None:
    """Print the topics, services and actions of a node.

    Raises:
        CommandError: There is no such node.
    """
    name = full_name(args.node_name)
    with Session(args) as session:
        session.discover(lambda: name in session.node_names(hidden=args.include_hidden))
        count = session.node_names(hidden=args.include_hidden).count(name)
        if count == 0:
            raise CommandError(f"Unable to find node '{name}'")
        if count > 1:
            print(
                f'There are {count} nodes in the graph with the exact name "{name}". '
                'You are seeing information about only one of them.',
                file=sys.stderr,
            )
        print(name)
        for title, names_and_types in _connections(session.node, name):
            print(f'  {title}:')
            _print_connections(names_and_types, hidden=args.include_hidden)


def _connections(node: Any, name: str) -> list[tuple[str, list[tuple[str, list[str]]]]]:
    namespace, _, base = name.rpartition('/')
    at = (base, namespace or '/')
    return [
        ('Subscribers', node.get_subscriber_names_and_types_by_node(*at)),
        ('Publishers', node.get_publisher_names_and_types_by_node(*at)),
        ('Service Servers', node.get_service_names_and_types_by_node(*at)),
        ('Service Clients', node.get_client_names_and_types_by_node(*at)),
        ('Action Servers', get_action_server_names_and_types_by_node(node, *at)),
        ('Action Clients', get_action_client_names_and_types_by_node(node, *at)),
    ]


def _print_connections(names_and_types: list[tuple[str, list[str]]], *, hidden: bool) -> None:
    """Print one line each, or, as ros2cli does, an empty line where there is none."""
    lines = [
        f'    {name}: {", ".join(types)}'
        for name, types in names_and_types
        if hidden or not any(part.startswith('_') for part in name.split('/'))
    ]
    print('\n'.join(lines))
