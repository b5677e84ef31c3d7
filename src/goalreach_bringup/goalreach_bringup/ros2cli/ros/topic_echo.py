"""`ros2 topic echo`: what goes over a topic, as text."""

import argparse
import re
from typing import Any, Final

from rclpy.event_handler import SubscriptionEventCallbacks
import yaml

from goalreach_bringup.ros2cli.arguments import COUNT, FILTER, SECONDS, TOPIC
from goalreach_bringup.ros2cli.message_text import TextOptions, message_to_csv, message_to_yaml
from goalreach_bringup.ros2cli.ros.qos import (
    add_qos_arguments,
    compatible_profile,
    profile_from_options,
)
from goalreach_bringup.ros2cli.ros.session import Session, add_verb
from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.interfaces import message_class

_INDEX = re.compile(r'\[(-?\d+)\]$')


_LENGTH: Final = 'The length to truncate arrays, bytes, and strings to (default: %(default)s)'
TEXT_ARGUMENTS: Final = (
    ('--csv', 'Output comma-separated values'),
    ('-f --full-length', 'Output all elements of arrays and text'),
    ('-l --truncate-length', _LENGTH, {**COUNT, 'default': 128}),
    ('--no-arr', "Don't print array fields of messages"),
    ('--no-str', "Don't print string fields of messages"),
    ('--flow-style', 'Print lists on one line (not with --csv)'),
)
"""Arguments that `topic echo` and `service echo` share."""


def add_to(verbs: Any) -> None:
    """Add the verb to the sub-parsers of `ros2 topic`."""
    verb = add_verb(
        verbs,
        'echo',
        'Output messages from a topic',
        echo_topic,
        TOPIC,
        ('message_type', "Type (e.g. 'std_msgs/msg/String')", {'nargs': '?'}),
        ('--field', "Echo one field (e.g. 'pose.pose' or 'status.[0].values')", {}),
        ('--filter', 'Print if this Python expression of m, message or --field, is true', FILTER),
        ('--no-lost-messages', "Don't report when a message is lost"),
        ('--raw', 'Echo the serialized message'),
        ('--once', 'Exit after the first message'),
        ('-i --include-message-info', 'Show the message info'),
        ('--timeout', 'Exit after so many seconds', SECONDS),
        *TEXT_ARGUMENTS,
    )
    add_qos_arguments(verb, preset='sensor_data')


def text_options(args: argparse.Namespace) -> TextOptions:
    """Return the parsed options `TEXT_ARGUMENTS`, but for `--csv`."""
    return TextOptions(
        truncate_length=None if args.full_length else args.truncate_length,
        no_arr=args.no_arr,
        no_str=args.no_str,
        flow_style=args.flow_style,
    )


def echo_topic(args: argparse.Namespace) -> None:
    """Print the messages of a topic as they arrive.

    Raises:
        CommandError: The topic is not there, its type is not known, or the field is wrong.
    """
    path = _field_path(args.field)
    with Session(args) as session:
        node = session.node
        topic = node.resolve_topic_name(args.topic_name)
        profile = profile_from_options(args)
        if profile is None or args.message_type is None:
            session.discover(lambda: bool(node.count_publishers(topic)))
        if profile is None:
            publishers = node.get_publishers_info_by_topic(topic)
            profile, notes = compatible_profile(args.qos_profile, publishers)
            for note in notes:
                print(note)
        echo = _Echo(args, path)
        node.create_subscription(
            message_class(args.message_type or topic_type(session, topic)),
            topic,
            echo.on_message,
            profile,
            raw=args.raw,
            event_callbacks=SubscriptionEventCallbacks(
                message_lost=None if args.no_lost_messages else _on_lost
            ),
        )
        session.spin_until(lambda: args.once and echo.count > 0, args.timeout)


def topic_type(session: Session, topic: str) -> str:
    """Return the one type of a topic.

    Raises:
        CommandError: The topic is not there, or has more than one type.
    """
    types = session.topics().get(topic, [])
    if not types:
        print(f'WARNING: topic [{topic}] does not appear to be published yet')
        raise CommandError('Could not determine the type for the passed topic')
    if len(types) > 1:
        raise CommandError(
            f"Cannot echo topic '{topic}', as it contains more than one type: [{', '.join(types)}]"
        )
    return types[0]


class _Echo:
    """Prints each message that it is given.

    Args:
        args: The options of the command.
        path: Names and indices that lead to the field to print.

    Attributes:
        count: Messages printed.
    """

    def __init__(self, args: argparse.Namespace, path: list[str]) -> None:
        self.count = 0
        self._args = args
        self._path = path
        self._options = text_options(args)

    def on_message(self, message: Any, info: dict[str, Any]) -> None:
        """Print one message.

        Raises:
            CommandError: It has no such field, or cannot be filtered.
        """
        value = _select(message, self._path)
        if self._args.filter is not None and not self._args.filter(value):
            return
        if not hasattr(value, 'get_fields_and_field_types'):
            text = self._plain(value, info)
        elif self._args.csv:
            values = [*map(str, info.values())] if self._args.include_message_info else []
            text = ','.join([*values, message_to_csv(value, self._options)]) + '\n'
        else:
            head = f'{yaml.dump(info)}---\n' if self._args.include_message_info else ''
            text = f'{head}{message_to_yaml(value, self._options)}---\n'
        print(text, end='', flush=True)
        self.count += 1

    def _plain(self, value: object, info: dict[str, Any]) -> str:
        """Return the text of a number, a string, an array or serialized bytes."""
        head = ''
        if self._args.include_message_info:
            head = f'---Got new message, message info:---\n{info}\n---Message data:---\n'
        return f'{head}{value}\n---\n'


def _field_path(field: str | None) -> list[str]:
    path = [name for name in (field or '').split('.') if name]
    if field is not None and not path:
        raise CommandError(f"Invalid field value '{field}'")
    return path


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
