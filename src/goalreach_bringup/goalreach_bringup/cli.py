"""The command line: `goalreach COMMAND`, and the same through `scripts/NAME.py`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import contextlib
import importlib
import os
import signal
import sys
from types import ModuleType
from typing import Final

from goalreach_msgs_py.errors import GoalreachError

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
)
_STATUS_INTERRUPTED = 130
_PROGRAM = 'goalreach'


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        arguments: The command's name and its arguments, or None for the process's own.

    Returns:
        The exit status: 0 for success; a mistake of the user, told in one line, has the status
        of its error, usually 2.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given and given[0] in COMMANDS:
        return run_command(_load(given[0]), given[0], given[1:])
    parser = argparse.ArgumentParser(
        prog=_PROGRAM,
        description='A robot learns to reach its goal by what it sees, on ROS 2.',
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=_list_of_commands(),
    )
    parser.add_argument('command', metavar='COMMAND', choices=COMMANDS, help='see below')
    parser.parse_args(given)
    return 0


def _list_of_commands() -> str:
    width = max(map(len, COMMANDS))
    lines = [f'  {name:<{width}}  {_load(name).SUMMARY}' for name in COMMANDS]
    return 'commands:\n' + '\n'.join(lines)


def _load(name: str) -> ModuleType:
    return importlib.import_module(f'goalreach_bringup.commands.{name}')


def run_command(command: ModuleType, name: str, arguments: Sequence[str]) -> int:
    """Parse the options of a command and execute it; report a mistake of the user in one line.

    Args:
        command: Module with `SUMMARY`, `configure` and `execute`.
        name: What the user calls it.
        arguments: Its arguments.

    Returns:
        The exit status.
    """
    parser = argparse.ArgumentParser(
        prog=f'{_PROGRAM} {name}',
        description=command.SUMMARY,
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    if name != 'ros2':
        parser.add_argument(
            '--seed', type=int, default=0, help='seed of everything random, for a repeatable run'
        )
    command.configure(parser)
    options = parser.parse_args(arguments)
    try:
        status = int(command.execute(options))
        sys.stdout.flush()  # or a reader that has gone is noticed only when the interpreter ends
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
