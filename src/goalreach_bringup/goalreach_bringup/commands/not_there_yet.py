"""The honest answer of a command that is planned and not written."""

from __future__ import annotations

from goalreach_msgs_py.errors import GoalreachError

__all__ = ['refuse']


def refuse(command: str) -> int:
    """Say that a command is not there yet.

    Raises:
        GoalreachError: Always.
    """
    raise GoalreachError(f'`{command}` is not there yet in this version')
