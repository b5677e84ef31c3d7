"""The `ros2` command line."""

import argparse
import importlib
import sys
from typing import Final

from goalreach_bringup.ros2cli.arguments import TerminatedError
from goalreach_msgs_py.errors import GoalreachError

COMMANDS: Final = {
    'interface': 'Show information about ROS interfaces',
    'node': 'Various node related sub-commands',
    'param': 'Various param related sub-commands',
    'service': 'Various service related sub-commands',
    'topic': 'Various topic related sub-commands',
}
"""Summary by command. The verbs are in the module `ros.<command>`."""

_DIFFERENCES: Final = (
    'Differences from ros2cli 0.32: values that do not fit a field are refused, not converted; '
    'a parameter change that is refused ends with status 1; discovery ends as soon as the graph '
    'has settled, without a daemon; hz takes one topic; the other commands are not there. '
    'Statuses: 0, 1 with one line on stderr, 2 for an invalid command line.'
)
_TERMINATED: Final = 143


def main(arguments: list[str]) -> int:
    """Run one `ros2` command.

    Args:
        arguments: What follows `ros2`, such as `['topic', 'list']`.

    Returns:
        The exit status: 0; 1 after one line on stderr; 143 after SIGTERM.

    Raises:
        BrokenPipeError: The reader of the output has gone.
        KeyboardInterrupt: After Ctrl-C.
        SystemExit: After `--help`, and with status 2 for an invalid command line.
    """
    parser = make_parser(arguments)
    args = parser.parse_args(arguments)
    if not hasattr(args, 'run'):
        parser.print_help()
        return 0
    try:
        args.run(args)
        sys.stdout.flush()
    except GoalreachError as error:
        print(error, file=sys.stderr)
        return 1
    except TerminatedError:
        return _TERMINATED
    return 0


def make_parser(arguments: list[str]) -> argparse.ArgumentParser:
    """Return the parser, with the verbs of the given command only: each imports ROS."""
    parser = argparse.ArgumentParser(
        prog='ros2',
        description='ros2 is an extensible command-line tool for ROS 2. This is the part of it '
        'that comes with goalreach; the real one is used where it is on the PATH.',
        epilog=_DIFFERENCES,
    )
    commands = parser.add_subparsers(title='Commands', metavar='COMMAND')
    for name, summary in COMMANDS.items():
        command = commands.add_parser(name, help=summary, description=summary, epilog=_DIFFERENCES)
        if name in arguments[:1]:
            module = importlib.import_module(f'goalreach_bringup.ros2cli.ros.{name}')
            module.add_verbs(command)
    return parser
