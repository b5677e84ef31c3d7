"""What a user of `ros2` can get wrong."""

from __future__ import annotations

from goalreach_msgs_py.errors import GoalreachError

__all__ = ['CommandError', 'TerminatedError']


class CommandError(GoalreachError):
    """A topic, node, type, value or service that is not there or does not fit."""


class TerminatedError(Exception):
    """The command was asked to end, by SIGTERM."""
