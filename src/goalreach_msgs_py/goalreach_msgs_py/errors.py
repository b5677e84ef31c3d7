"""Errors that a user can cause and a user can mend."""

from __future__ import annotations

import reprlib

_LONGEST = 1000
"""Characters of a line that tells of a mistake; chosen."""


def _bounded() -> reprlib.Repr:
    """Return what shows a value in bounded time: a small file can describe a huge one."""
    shown = reprlib.Repr()
    shown.maxlevel = 3
    shown.maxtuple = shown.maxlist = shown.maxdict = 24
    shown.maxstring = shown.maxother = 120
    shown.maxlong = 60
    return shown


_REPR = _bounded()


def one_line(text: object) -> str:
    """Return a text on one line of bounded length, without control characters."""
    line = ''.join(c if c.isprintable() else '?' for c in str(text)[: _LONGEST + 1])
    return line if len(line) <= _LONGEST else line[: _LONGEST - 3] + '...'


def one_line_repr(value: object) -> str:
    """Return how a value is written in Python, shortened where it is long."""
    return one_line(_REPR.repr(value))


class GoalreachError(Exception):
    """A mistake in what a user gave: its text is one clear line, shown without a traceback.

    Attributes:
        status: Exit status of a command that ends with it.
    """

    status = 2


class ConfigurationError(GoalreachError):
    """A configuration value that cannot be used.

    Args:
        field: Name of the field or parameter, dotted where it is nested.
        value: The value that was refused.
        allowed: What would have been accepted, as a phrase that follows "must be".
    """

    def __init__(self, field: str, value: object, allowed: str) -> None:
        """Compose the line from its three parts and keep them as attributes."""
        super().__init__(f'{one_line(field)} = {one_line_repr(value)}: must be {allowed}')
        self.field = field
        self.value = value
        self.allowed = allowed


class FileFormatError(GoalreachError):
    """A file that is not what it should be.

    Args:
        path: The file as the user named it.
        reason: What is wrong, with the field and the value where there are any.
    """

    def __init__(self, path: object, reason: str) -> None:
        """Compose the line `path: reason`."""
        super().__init__(f'{path}: {one_line(reason)}')
        self.path = str(path)
        self.reason = reason


class CommandError(GoalreachError):
    """A topic, node, type, value or service that is not there or does not fit."""
