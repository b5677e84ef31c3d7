"""Errors that a user can cause and a user can mend."""

from __future__ import annotations

__all__ = ['ConfigurationError', 'FileFormatError', 'GoalreachError']


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
        super().__init__(f'{field} = {value!r}: must be {allowed}')
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
        super().__init__(f'{path}: {reason}')
        self.path = str(path)
        self.reason = reason
