"""The `ros2` command line."""

import argparse
from collections.abc import Callable, Iterable, Sequence
import importlib
from importlib import resources
import math
from pathlib import Path
import re
import sys
from typing import Any, Final

import yaml

from goalreach_msgs_py.errors import GoalreachError

_WORDS: Final = Path(str(resources.files('goalreach_bringup'))) / 'config' / 'ros2.yaml'
_FUNCTIONS: Final = 'goalreach_bringup.ros2cli.ros'
_NAME: Final = re.compile(r'(?:~/|/)?(?:[A-Za-z_{][\w{}]*/)*[A-Za-z_{][\w{}]*$', re.ASCII)

_DIFFERENCES: Final = (
    'Differences from ros2cli 0.32: values that do not fit a field are refused, not converted; '
    'a parameter change that is refused ends with status 1; discovery ends as soon as the graph '
    'has settled, without a daemon; the other commands and options are not there. '
    'Statuses: 0, 1 with one line on stderr, 2 for an invalid command line.'
)


def main(arguments: list[str]) -> int:
    """Run one `ros2` command, from what follows `ros2`; return 0, or 1 after one line on stderr.

    Raises:
        BrokenPipeError: The reader of the output has gone.
        SystemExit: After `--help`; with status 2 for an invalid command line, 130 after SIGINT,
            143 after SIGTERM.
    """
    parser = make_parser(arguments)
    args = parser.parse_args(arguments)
    if not hasattr(args, 'run'):
        parser.print_help()
        return 0
    try:
        module, _, name = args.run.partition('.')
        getattr(importlib.import_module(f'{_FUNCTIONS}.{module}'), name)(args)
        sys.stdout.flush()
    except GoalreachError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def make_parser(arguments: list[str]) -> argparse.ArgumentParser:
    """Return the parser, with the verbs of the given command only."""
    parser = argparse.ArgumentParser(
        prog='ros2',
        description='ros2 is an extensible command-line tool for ROS 2. This is the part of it '
        'that comes with goalreach; the real one is used where it is on the PATH.',
        epilog=_DIFFERENCES,
    )
    commands = parser.add_subparsers(title='Commands', metavar='COMMAND')
    words = yaml.safe_load(_WORDS.read_text(encoding='utf-8'))
    for name, command in words['commands'].items():
        about = command['summary']
        group = commands.add_parser(name, help=about, description=about, epilog=_DIFFERENCES)
        if name in arguments[:1]:
            verbs = group.add_subparsers(title='Commands', metavar='VERB', required=True)
            for verb, its in command['verbs'].items():
                about = its['summary']
                one = verbs.add_parser(verb, help=about, description=about)
                _add(one, its.get('arguments', ()))
                if 'exclusive' in its:
                    _add(one.add_mutually_exclusive_group(), its['exclusive'])
                _add(one, words['arguments'])
                one.set_defaults(noun=name, run=its['run'])
    return parser


def _add(parser: Any, rows: Iterable[Sequence[Any]]) -> None:  # noqa: ANN401 - or a group of one
    """Add arguments to a parser or a group, as `ros2.yaml` describes them."""
    for names, text, *more in rows:
        settings = dict(more[0]) if more else {'action': 'store_true'} if names[0] == '-' else {}
        if 'type' in settings:
            settings['type'] = _TYPES[settings['type']]
        parser.add_argument(*names.split(), help=text, **settings)


def _number(kind: Callable[[str], float], least: float, wanted: str) -> Callable[[str], float]:
    """Return a type of numbers that are finite and at least so much."""

    def parse(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not least <= value < math.inf:
            raise argparse.ArgumentTypeError(f'value must be a {wanted}')
        return value

    return parse


def _ros_name(text: str) -> str:
    if not _NAME.match(text):
        raise argparse.ArgumentTypeError(f'{text!r} is not a name of ROS')
    return text


_TYPES: Final = {
    'count': _number(int, 0, 'non-negative integer'),
    'positive_count': _number(int, 1, 'positive integer'),
    'positive': _number(float, math.ulp(0.0), 'positive number'),
    'name': _ros_name,
}
"""Types of arguments by their names in `ros2.yaml`."""
