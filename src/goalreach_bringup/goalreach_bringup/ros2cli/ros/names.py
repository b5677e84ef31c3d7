"""What `ros2 topic` and `ros2 service` share: `list`, `find`, `type` and `info`."""

import argparse
import sys
from typing import Any

from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from goalreach_bringup.ros2cli.arguments import add, ros_name
from goalreach_bringup.ros2cli.ros.session import Session, add_verb
from goalreach_msgs_py.errors import CommandError


def add_verbs(parser: argparse.ArgumentParser, noun: str) -> Any:
    """Add the verbs for one kind of names; return the sub-parsers for further ones.

    Args:
        parser: Parser of the command.
        noun: 'topic' or 'service'.
    """
    flag, text = f'--include-hidden-{noun}s', f'Consider hidden {noun}s as well'
    add(parser, (flag, text, {'action': 'store_true', 'dest': 'hidden'}))
    hidden = {'action': 'store_true', 'dest': 'hidden', 'default': argparse.SUPPRESS}
    shown = ((f'-c --count-{noun}s', f'Only display the number of {noun}s'), (flag, text, hidden))
    types = ('-t --show-types', f'Additionally show the {noun} type')
    wanted = ('type_name', 'Type to find', {'metavar': f'{noun}_type'})
    named = ('name', f'Name of the ROS {noun}', {'metavar': f'{noun}_name', 'type': ros_name})
    verbs = parser.add_subparsers(title='Commands', metavar='VERB', required=True)
    for name, about, run, rows in (
        ('list', f'Output a list of available {noun}s', list_names, (types, *shown)),
        ('find', f'Output a list of {noun}s of a given type', list_names, (wanted, *shown)),
        ('type', f"Print a {noun}'s type", print_types, (named,)),
        ('info', f'Print information about a {noun}', print_info, (named,)),
    ):
        verb = add_verb(verbs, name, about, run, *rows)
        verb.set_defaults(noun=noun, verbose=False, show_types=False, type_name=None)
    return verbs


def _all(session: Session, noun: str) -> dict[str, list[str]]:
    return session.topics() if noun == 'topic' else session.services()


def list_names(args: argparse.Namespace) -> None:
    """Print the names of the topics or services, those of a type alone where one is given."""
    with Session(args) as session:
        session.discover()
        found = {
            name: types
            for name, types in _all(session, args.noun).items()
            if (args.hidden or not topic_or_service_is_hidden(name))
            and (args.type_name is None or args.type_name in types)
        }
        count = getattr(args, f'count_{args.noun}s')
        if args.verbose and not count:
            counts = (session.node.count_publishers, session.node.count_subscribers)
            _print_counts('Published', 'publisher', {n: counts[0](n) for n in found}, found)
            _print_counts('Subscribed', 'subscriber', {n: counts[1](n) for n in found}, found)
            return
    if count:
        print(len(found))
        return
    for name, types in found.items():
        print(f'{name} [{", ".join(types)}]' if args.show_types else name)


def _print_counts(
    title: str, noun: str, counts: dict[str, int], types: dict[str, list[str]]
) -> None:
    print(f'{title} topics:')
    for name, count in counts.items():
        if count:
            plural = '' if count == 1 else 's'
            print(f' * {name} [{", ".join(types[name])}] {count} {noun}{plural}')
    print()


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
