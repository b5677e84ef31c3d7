"""Types and groups of command-line arguments."""

import argparse
from collections.abc import Callable
import math
import re
import sys
from types import CodeType
from typing import Any, Final

from goalreach_msgs_py.errors import CommandError

_NAME: Final = re.compile(r'(?:~/|/)?(?:[A-Za-z_{][\w{}]*/)*[A-Za-z_{][\w{}]*$', re.ASCII)


def add(parser: Any, *rows: tuple[Any, ...]) -> None:  # noqa: ANN401 - or a group of one
    """Add arguments to a parser.

    Args:
        parser: A parser, or a group of one.
        rows: Names with spaces between them, help, and what else `add_argument` takes, as a
            mapping; without one, an option is a flag.
    """
    for names, text, *more in rows:
        settings = more[0] if more else {'action': 'store_true'} if names[0] == '-' else {}
        parser.add_argument(*names.split(), help=text, **settings)


def _number(kind: Callable[[str], Any], least: float, wanted: str) -> Callable[[str], Any]:
    """Return a type of numbers that are finite and at least so much."""

    def parse(text: str) -> Any:  # noqa: ANN401 - of the kind
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not least <= value < math.inf:
            raise argparse.ArgumentTypeError(f'value must be a {wanted}')
        return value

    return parse


positive_int = _number(int, 1, 'positive integer')
non_negative_int = _number(int, 0, 'non-negative integer')
positive_float = _number(float, math.ulp(0.0), 'positive number')


def regular_expression(text: str) -> re.Pattern[str]:
    """Return the expression, compiled.

    Raises:
        argparse.ArgumentTypeError: It is none.
    """
    try:
        return re.compile(text)
    except re.error as error:
        raise argparse.ArgumentTypeError(f'{text!r} is no regular expression: {error}') from None


def ros_name(text: str) -> str:
    """Return the name of a topic or service, which may be relative or private.

    Raises:
        argparse.ArgumentTypeError: It is none.
    """
    if not _NAME.match(text):
        raise argparse.ArgumentTypeError(f'{text!r} is not a name of ROS')
    return text


def message_filter(text: str) -> Callable[[Any], bool]:
    """Return the function of a message `m` that a Python expression describes.

    Like the real `ros2`, it evaluates the expression of its own user, who may run Python anyway.

    Raises:
        argparse.ArgumentTypeError: The text is not an expression.
    """
    try:
        code: CodeType = compile(text, '--filter', 'eval')
    except (SyntaxError, ValueError) as error:
        raise argparse.ArgumentTypeError(f'{text!r} is not an expression: {error}') from None

    def passes(message: Any) -> bool:  # noqa: ANN401 - a message or a field of one
        try:
            return bool(eval(code, {'m': message}))  # noqa: S307 - the user's own command line
        except Exception as error:  # noqa: BLE001 - an expression may raise anything
            raise CommandError(f'--filter {text!r}: {type(error).__name__}: {error}') from None

    return passes


def add_values(parser: argparse.ArgumentParser, text: str) -> None:
    """Add the argument that fills a message, or its source on standard input."""
    group = parser.add_mutually_exclusive_group()
    add(
        group,
        ('values', text, {'nargs': '?', 'default': '{}'}),
        ('--stdin', 'Read values from standard input'),
    )


def values_text(args: argparse.Namespace) -> str:
    """Return the YAML text of the values.

    Raises:
        CommandError: Standard input is not UTF-8 text.
    """
    if not args.stdin:
        return str(args.values)
    try:
        return sys.stdin.buffer.read().decode()
    except UnicodeDecodeError:
        raise CommandError('The values on standard input are not UTF-8 text') from None


TOPIC: Final = ('topic_name', "Name of the ROS topic (e.g. '/chatter')", {'type': ros_name})
COUNT: Final = {'metavar': 'N', 'type': non_negative_int}
SECONDS: Final = {'metavar': 'S', 'type': positive_float}
FILTER: Final = {'metavar': 'EXPR', 'type': message_filter}


class TerminatedError(Exception):
    """The command was asked to end, by SIGTERM."""
