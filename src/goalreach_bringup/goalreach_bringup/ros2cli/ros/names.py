"""What `ros2 topic` and `ros2 service` share: `list`, `find`, `type` and `info`."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from goalreach_bringup.ros2cli.arguments import add_flags
from goalreach_bringup.ros2cli.ros.session import Session, add_session_arguments
from goalreach_msgs_py.errors import CommandError


def add_verbs(parser: argparse.ArgumentParser, noun: str) -> Any:
    """Add the verbs for one kind of names; return the sub-parsers for further ones.

    Args:
        parser: Parser of the command.
        noun: 'topic' or 'service'.
    """
    hidden = (f'--include-hidden-{noun}s', f'Consider hidden {noun}s as well')
    parser.add_argument(hidden[0], action='store_true', dest='hidden', help=hidden[1])
    verbs = parser.add_subparsers(title='Commands', metavar='VERB', required=True)
    for name, text, run in (
        ('list', f'Output a list of available {noun}s', list_names),
        ('find', f'Output a list of available {noun}s of a given type', find_names),
        ('type', f"Print a {noun}'s type", print_types),
        ('info', f'Print information about a {noun}', print_info),
    ):
        verb = verbs.add_parser(name, help=text)
        add_session_arguments(verb)
        verb.set_defaults(run=run, noun=noun, verbose=False)
        if name in ('list', 'find'):
            add_flags(verb, ('-c', f'--count-{noun}s', f'Only display the number of {noun}s'))
            verb.add_argument(
                hidden[0],
                action='store_true',
                dest='hidden',
                default=argparse.SUPPRESS,
                help=hidden[1],
            )
    add_flags(verbs.choices['list'], ('-t', '--show-types', f'Additionally show the {noun} type'))
    verbs.choices['find'].add_argument('type_name', metavar=f'{noun}_type', help='Type to find')
    for name in ('type', 'info'):
        verbs.choices[name].add_argument(
            'name', metavar=f'{noun}_name', help=f'Name of the ROS {noun}'
        )
    return verbs


def _all(session: Session, noun: str) -> dict[str, list[str]]:
    return session.topics() if noun == 'topic' else session.services()


def _visible(session: Session, args: argparse.Namespace) -> dict[str, list[str]]:
    session.discover()
    return {
        name: types
        for name, types in _all(session, args.noun).items()
        if args.hidden or not topic_or_service_is_hidden(name)
    }


def _print(lines: list[str], args: argparse.Namespace) -> None:
    if getattr(args, f'count_{args.noun}s'):
        print(len(lines))
    elif lines:
        print('\n'.join(lines))


def list_names(args: argparse.Namespace) -> None:
    """Print the names of the topics or services."""
    with Session(args) as session:
        found = _visible(session, args)
        if args.verbose and not args.count_topics:
            node = session.node
            for title, noun, count in (
                ('Published', 'publisher', node.count_publishers),
                ('Subscribed', 'subscriber', node.count_subscribers),
            ):
                _print_counts(title, noun, {name: count(name) for name in found}, found)
            return
    shown = {
        name: f' [{", ".join(types)}]' if args.show_types else '' for name, types in found.items()
    }
    _print([f'{name}{types}' for name, types in shown.items()], args)


def _print_counts(
    title: str, noun: str, counts: dict[str, int], types: dict[str, list[str]]
) -> None:
    print(f'{title} topics:')
    for name, count in counts.items():
        if count:
            plural = '' if count == 1 else 's'
            print(f' * {name} [{", ".join(types[name])}] {count} {noun}{plural}')
    print()


def find_names(args: argparse.Namespace) -> None:
    """Print the names of the topics or services of a type."""
    with Session(args) as session:
        found = _visible(session, args)
    _print([name for name, types in found.items() if args.type_name in types], args)


def print_types(args: argparse.Namespace) -> None:
    """Print the types of a topic or service; end with status 1 where there is none, as ros2cli."""
    with Session(args) as session:
        name = _resolve(session, args)
        session.discover(lambda: name in _all(session, args.noun))
        types = _all(session, args.noun).get(name, [])
    if not types:
        sys.exit(1)
    print('\n'.join(types))


def _resolve(session: Session, args: argparse.Namespace) -> str:
    node = session.node
    resolve = node.resolve_topic_name if args.noun == 'topic' else node.resolve_service_name
    return str(resolve(args.name))


def print_info(args: argparse.Namespace) -> None:
    """Print the type of a topic or service, and how many nodes offer and use it.

    Raises:
        CommandError: There is no such topic or service.
    """
    with Session(args) as session:
        node, name, end = session.node, _resolve(session, args), '\n\n' if args.verbose else '\n'
        if not session.discover(lambda: name in _all(session, args.noun)):
            raise CommandError(f"Unknown {args.noun} '{args.name}'")
        types = _all(session, args.noun)[name]
        print(f'Type: {types[0] if len(types) == 1 else types}', end=end)
        if args.noun == 'service':
            print(f'Clients count: {node.count_clients(name)}')
            print(f'Services count: {node.count_services(name)}')
            return
        print(f'Publisher count: {node.count_publishers(name)}', end=end)
        for info in node.get_publishers_info_by_topic(name) if args.verbose else ():
            print(info, end=end)
        print(f'Subscription count: {node.count_subscribers(name)}', end=end)
        for info in node.get_subscriptions_info_by_topic(name) if args.verbose else ():
            print(info, end=end)
