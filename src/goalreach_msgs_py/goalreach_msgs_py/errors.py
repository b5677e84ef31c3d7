"""Errors that a user can cause and correct."""

import reprlib

_LONGEST = 1000
"""Longest error message, characters. Chosen."""


# Bounded in time and length: a small file can describe a huge value.
_REPR = reprlib.Repr()
_REPR.maxlevel = 3
_REPR.maxtuple = _REPR.maxlist = _REPR.maxdict = 24
_REPR.maxstring = _REPR.maxother = 120
_REPR.maxlong = 60


def one_line(text: object) -> str:
    """Return a text on one line of bounded length, without control characters."""
    line = ''.join(c if c.isprintable() else '?' for c in str(text)[: _LONGEST + 1])
    return line if len(line) <= _LONGEST else line[: _LONGEST - 3] + '...'


def one_line_repr(value: object) -> str:
    """Return the `repr` of a value, shortened where it is long."""
    return one_line(_REPR.repr(value))


class GoalreachError(Exception):
    """Invalid input of a user: its text is one clear line, shown without a traceback.

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
    """A file that cannot be used: its name as the user gave it, and the reason.

    The reason names the field and the value where there are any.
    """

    def __init__(self, path: object, reason: str) -> None:
        """Compose the line `path: reason`."""
        super().__init__(f'{path}: {one_line(reason)}')
        self.path = str(path)
        self.reason = reason


class CommandError(GoalreachError):
    """A topic, node, type, value or service that does not exist, does not match or refuses."""
