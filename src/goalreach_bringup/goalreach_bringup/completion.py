"""Completion of a command line by argcomplete: commands, options, choices, names and files."""

import argparse
from collections.abc import Callable, Sequence
import os
from typing import Any, Final

import argcomplete
from argcomplete.completers import FilesCompleter
from argcomplete.lexers import split_line

from goalreach_bags.recording import RUN_TOPICS
from goalreach_bringup.command import Command
from goalreach_bringup.ros2cli.main import make_parser
from goalreach_msgs_py import topics

_NAMES: Final = {
    'node_name': [f'/{name}' for name in topics.NODES],
    'topic_name': RUN_TOPICS,
    'service_name': (topics.RESET_SERVICE, topics.PAUSE_SERVICE),
}
"""What `ros2` arguments name: of goalreach's own graph, as finding another's takes a second."""


def complete(commands: Sequence[str], load_command: Callable[[str], Command]) -> None:
    """Print the completions of `COMP_LINE`, which the shell sets, and end the process."""
    words = split_line(os.environ['COMP_LINE'], int(os.environ['COMP_POINT']))[3]
    start = int(os.environ['_ARGCOMPLETE'])
    command, *arguments = words[start:] or ['']
    if command not in commands:
        parser = argparse.ArgumentParser()
        parser.add_argument('command', choices=commands)
        parser.add_argument('--version', action='version')
    else:
        os.environ['_ARGCOMPLETE'] = str(start + 1)  # the command is the program
        ros2 = command == 'ros2'
        parser = make_parser(arguments) if ros2 else load_command(command).parser(command)
    argcomplete.autocomplete(parser, default_completer=_Values())


class _Values(FilesCompleter):
    """Completes the value of an argument: its choices and names, and files where it takes them."""

    def __call__(self, prefix: str, **given: Any) -> list[str]:  # noqa: ANN401 - as its base
        action = given['action']
        option = getattr(action.type, '__self__', None)  # its `convert` is the type
        if option is None:
            return list(_NAMES.get(action.dest, ()))
        takes_files = option.base.__name__ == 'Path' or 'FILE' in option.info.metavar
        files = super().__call__(prefix) if takes_files else ()
        return [*option.info.choices, *option.info.names, *files]
