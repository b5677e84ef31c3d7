"""The command line: `goalreach COMMAND`, and the same through `scripts/NAME.py`.

This module imports nothing large, so that the fork server of a run starts at once.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import contextlib
import importlib
from importlib.metadata import version
import os
import signal
import sys
from typing import TYPE_CHECKING, Final

from goalreach_bringup.launch.child_process import start_fork_server

if TYPE_CHECKING:
    from goalreach_bringup.command import Command

COMMANDS: Final = (
    'run',
    'train',
    'evaluate',
    'sweep',
    'record',
    'replay',
    'bag',
    'figures',
    'dashboard',
    'bench',
    'ros2',
    'doctor',
)
ROS_COMMANDS: Final = ('run', 'record', 'replay', 'dashboard', 'ros2')
_STATUS_INTERRUPTED = 130
_PROGRAM = 'goalreach'
_FORKING = ('run',)
"""Commands that fork nodes: the fork server starts to import before the command does."""


def load_command(name: str) -> Command:
    """Return the command of a name, from its module in `commands`."""
    from goalreach_bringup.command import Command

    return Command.of_module(importlib.import_module(f'goalreach_bringup.commands.{name}'))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        arguments: The command's name and its arguments, or None for the process's own.

    Returns:
        The exit status: 0 for success; after a mistake of the user, reported in one line, the
        status of its error, usually 2.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given and given[0] in COMMANDS:
        if given[0] in _FORKING and not {'-h', '--help'}.intersection(given):
            start_fork_server()
        try:
            command = load_command(given[0])
        except KeyboardInterrupt:  # while it imports
            return _STATUS_INTERRUPTED
        return run_command(command, given[0], given[1:])
    parser = argparse.ArgumentParser(
        prog=_PROGRAM,
        description='A robot learns to reach a goal that it sees, on ROS 2.',
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=_list_of_commands(),
    )
    parser.add_argument('command', metavar='COMMAND', choices=COMMANDS, help='see below')
    parser.add_argument('--version', action='version', version=f'goalreach {version(_PROGRAM)}')
    parser.parse_args(given)
    return 0


def _list_of_commands() -> str:
    width = max(map(len, COMMANDS))
    lines = [f'  {name:<{width}}  {load_command(name).summary}' for name in COMMANDS]
    return 'commands:\n' + '\n'.join(lines)


def run_command(command: Command, name: str, arguments: Sequence[str]) -> int:
    """Parse the options of a command and execute it; report a mistake of the user in one line.

    Args:
        command: The command.
        name: Its name on the command line.
        arguments: Its arguments.

    Returns:
        The exit status.
    """
    from goalreach_bringup.variables import check_variables
    from goalreach_msgs_py.errors import GoalreachError

    try:
        if name in ROS_COMMANDS:
            check_variables(os.environ)
        status = command.run(f'{_PROGRAM} {name}', arguments)
        sys.stdout.flush()  # a closed pipe is noticed here, not when the interpreter ends
    except GoalreachError as error:
        sys.stderr.write(f'{_PROGRAM} {name}: {error}\n')
        return error.status
    except BrokenPipeError:
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + signal.SIGPIPE
    except KeyboardInterrupt:
        return _STATUS_INTERRUPTED
    return status


if __name__ == '__main__':
    raise SystemExit(main())
