"""Types and groups of command-line arguments."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import math
import sys
from types import CodeType
from typing import Any

from goalreach_msgs_py.errors import CommandError


def add_flags(parser: Any, *flags: tuple[str, ...]) -> None:  # noqa: ANN401 - or a group of one
    """Add flags to a parser, each given by its names and its help."""
    for *names, text in flags:
        parser.add_argument(*names, action='store_true', help=text)


def positive_int(text: str) -> int:
    """Return the integer, which must be 1 or more.

    Raises:
        argparse.ArgumentTypeError: It is not.
    """
    value = non_negative_int(text)
    if value == 0:
        raise argparse.ArgumentTypeError('value must be a positive integer')
    return value


def non_negative_int(text: str) -> int:
    """Return the integer, which must be 0 or more.

    Raises:
        argparse.ArgumentTypeError: It is not.
    """
    if not text.isdecimal():
        raise argparse.ArgumentTypeError('value must be a non-negative integer')
    return int(text)


def positive_float(text: str) -> float:
    """Return the number, which must be finite and more than 0.

    Raises:
        argparse.ArgumentTypeError: It is not.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError('value must be a positive number')
    return value


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


def add_filter(parser: argparse.ArgumentParser, action: str) -> None:
    """Add `--filter`.

    Args:
        parser: Parser of the verb.
        action: What happens to the messages that pass.
    """
    parser.add_argument(
        '--filter',
        type=message_filter,
        metavar='EXPR',
        help=f'Python expression of m, the message: only messages for which it is true {action}',
    )


def add_values(parser: argparse.ArgumentParser, text: str) -> None:
    """Add the argument that fills a message, or its source on standard input."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument('values', nargs='?', default='{}', help=text)
    add_flags(group, ('--stdin', 'Read values from standard input'))


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


class TerminatedError(Exception):
    """The command was asked to end, by SIGTERM."""
