# PYTHON_ARGCOMPLETE_OK
"""The command line: `goalreach COMMAND`, and the same through `scripts/NAME.py`.

This module imports nothing large, so that the fork server of a run starts at once.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import contextlib
import errno
import gc
import importlib
import os
import re
import signal
import sys
from typing import TYPE_CHECKING, Final

from goalreach_bringup.launch.child_process import start_fork_server

if TYPE_CHECKING:
    from goalreach_bringup.command import Command

COMMANDS: Final = (
    'run', 'train', 'evaluate', 'sweep', 'record', 'replay', 'bag', 'figures', 'dashboard', 'ros2',
    'doctor', 'check-robot', 'calibrate', 'tags', 'new-arena',
)  # fmt: skip
ROS_COMMANDS: Final = ('run', 'record', 'replay', 'dashboard', 'ros2', 'check-robot', 'calibrate')
_STATUS_INTERRUPTED = 130
_STREAMS: Final = ('stdin', 'stdout', 'stderr')
_UNWRITABLE: Final = (errno.EDQUOT, errno.EIO, errno.ENOSPC)
"""Errors of a write to a full disk or a terminal that has gone."""
_UNSTARTED: Final = ('failed to initialize', 'error creating node')
"""Errors of rclpy for what this machine or its variables do not allow."""
_PROGRAM = 'goalreach'


def load_command(name: str) -> Command:
    """Return the command of a name, from its module in `commands`."""
    from goalreach_bringup.command import Command

    module = f'goalreach_bringup.commands.{name.replace("-", "_")}'
    return Command.of_module(importlib.import_module(module))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command, by default that of the process's own arguments; return the exit status.

    It is 0 for success; after a mistake of the user, reported in one line, that of the error,
    usually 2.
    """
    if '_ARGCOMPLETE' in os.environ:
        from goalreach_bringup.completion import complete

        complete(COMMANDS, load_command)
    given = list(sys.argv[1:] if arguments is None else arguments)
    named = bool(given) and given[0] in COMMANDS
    program = f'{_PROGRAM} {given[0]}' if named else _PROGRAM
    return guarded(program, lambda: _run_named(*given) if named else _run_unnamed(given))


def _run_named(name: str, *arguments: str) -> int:
    from goalreach_bringup.variables import check_variables

    forks_nodes = name == 'run'
    if name in ROS_COMMANDS:
        check_variables(os.environ, starts_graph=forks_nodes)
    sys.path.append('')  # a learner of the user's own lies in the working folder
    if forks_nodes and not {'-h', '--help'}.intersection(arguments):
        start_fork_server()  # it begins to import before the command does
        gc.disable()  # until the run's loop begins: nothing to collect among imports
    return load_command(name).run(f'{_PROGRAM} {name}', arguments)


def _run_unnamed(given: Sequence[str]) -> int:
    from importlib.metadata import version

    width = max(map(len, COMMANDS))
    lines = [f'  {name:<{width}}  {load_command(name).summary}' for name in COMMANDS]
    parser = argparse.ArgumentParser(
        prog=_PROGRAM,
        description='A robot learns to reach a goal that it sees, on ROS 2.',
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='\n'.join(['commands:', *lines]),
    )
    parser.add_argument('command', metavar='COMMAND', choices=COMMANDS, help='see below')
    parser.add_argument('--version', action='version', version=f'goalreach {version(_PROGRAM)}')
    parser.parse_args(given)
    return 0


def guarded(program: str, execute: Callable[[], int]) -> int:
    """Run a program; report what its user can correct in one line, without a traceback.

    Returns:
        Its exit status: that of the error where it raises `GoalreachError`, 1 where its output
        cannot be written, 130 after Ctrl-C, 141 where the reader of its output has gone.
    """
    _open_closed_streams()
    if not re.fullmatch('0*[1-9][0-9]{0,4}', os.environ.get('COLUMNS', '1')):
        del os.environ['COLUMNS']  # as Python does; rich would print nothing, or fail
    try:
        try:
            return execute()
        finally:
            sys.stdout.flush()  # a lost output is noticed here, not when the interpreter ends
    except KeyboardInterrupt:
        return _STATUS_INTERRUPTED
    except (Exception, SystemExit) as error:
        line, status = _explain(error)
        if status is None:
            raise
    with contextlib.suppress(OSError):
        sys.stderr.write(f'{program}: {line}\n' if line else '')
    _discard_lost_streams()
    return status


def _explain(error: BaseException) -> tuple[str, int | None]:
    """Return a line for the user and an exit status, None for an error in the program."""
    from goalreach_msgs_py.errors import GoalreachError

    if isinstance(error, GoalreachError):
        return str(error), error.status
    if type(error).__name__ == 'RCLInvalidROSArgsError':
        return str(error).splitlines()[0].partition(', at /')[0], 2
    if type(error).__name__ == 'RCLError' and str(error).startswith(_UNSTARTED):
        return str(error).splitlines()[0], 2
    if isinstance(error, BrokenPipeError) or isinstance(error.__context__, BrokenPipeError):
        return '', 128 + signal.SIGPIPE  # rich turns it into SystemExit
    if isinstance(error, OSError) and error.errno in _UNWRITABLE and error.filename is None:
        return f'the output cannot be written: {error.strerror}', 1
    return '', None


def _open_closed_streams() -> None:
    """Open the null device for standard streams that are closed (`>&-`).

    A file opened later would take the number of such a stream, and all that is printed.
    """
    while (number := os.open(os.devnull, os.O_RDWR)) < len(_STREAMS):
        os.set_inheritable(number, True)
    os.close(number)
    for number, name in enumerate(_STREAMS):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, 'w' if number else 'r', closefd=False))


def _discard_lost_streams() -> None:
    """Let no stream that cannot be written fail again when the interpreter ends."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):
            stream.flush()
            continue
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


if __name__ == '__main__':
    raise SystemExit(main())
