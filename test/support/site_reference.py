"""Pages of the reference that are made from the declarations of options and parameters."""

import argparse
from collections.abc import Iterator, Sequence
import re

from goalreach_bringup.cli import COMMANDS, load_command
from goalreach_bringup.command import Command
from goalreach_bringup.launch.plan import NODE_CONFIGS
from goalreach_lab.template import table
from goalreach_msgs_py.parameters import flatten_config, parameter_infos


def command_sections() -> str:
    """Return a section for each command with its options."""
    parts = ['']
    for name in COMMANDS:
        command = load_command(name)
        program = f'goalreach {name}'
        parts.append(f'## {name}\n\n{command.summary}.\n\n{_options(command, program)}')
        for word, sub in command.subcommands.items():
            usage = _options(sub, f'{program} {word}')
            parts.append(f'### {name} {word}\n\n{sub.summary}.\n\n{usage}')
    return '\n\n'.join(parts) + '\n'


def parameter_sections() -> str:
    """Return a section for each node with its parameters."""
    parts = ['']
    for node, classes in NODE_CONFIGS.items():
        rows = [row for cls in classes for row in _parameter_rows(cls)]
        parts.append(f'## {node}\n\n' + table(('parameter', 'default', 'meaning'), rows))
    return '\n\n'.join(parts) + '\n'


def _parameter_rows(cls: type[object]) -> Iterator[tuple[str, str, str]]:
    defaults = flatten_config(cls())
    for name, info in parameter_infos(cls).items():
        default = defaults[name]
        shown = list(default) if isinstance(default, tuple) else default
        accepted = info.allowed('') if info.choices or info.minimum is not None else ''
        accepted = accepted or (f'<= {info.maximum:g}' if info.maximum is not None else '')
        meaning = info.description + (f'; {accepted.strip()}' if accepted else '')
        yield f'`{name}`', f'`{_number(shown)}`', _cell(meaning)


def _number(value: object) -> str:
    """Return a value as a parameter file has it, without digits that say nothing."""
    if isinstance(value, list):
        return '[' + ', '.join(map(_number, value)) + ']'
    if isinstance(value, bool):
        return str(value).lower()
    return f'{value:.6g}' if isinstance(value, float) else str(value) or "''"


def _options(command: Command, program: str) -> str:
    """Return the usage of a command and the table of its options."""
    parser = argparse.ArgumentParser(prog=program, add_help=False)
    command.add_to(parser)
    actions = [action for action in parser._actions if action.help != argparse.SUPPRESS]
    usage = re.sub(r'\s+', ' ', parser.format_usage().removeprefix('usage: ')).strip()
    usage = f'{program} COMMAND [OPTIONS]' if command.subcommands else _short(usage, actions)
    rows = [
        (_names(action).replace('|', r'\|'), _cell(str(action.help).replace('%%', '%')))
        for action in actions
    ]
    return f'```\n{usage}\n```\n\n{table(("option", "meaning"), rows)}'


def _short(usage: str, actions: Sequence[argparse.Action]) -> str:
    """Return the usage with the optional options left to the table."""
    program = re.split(r' [\[-]', usage, maxsplit=1)[0]
    required = [_names(a).strip('`') for a in actions if a.required and a.option_strings]
    positional = [_positional(a) for a in actions if not a.option_strings]
    return ' '.join([program, '[OPTIONS]', *required, *positional])


def _positional(action: argparse.Action) -> str:
    name = str(action.metavar or action.dest).upper()
    return f'[{name}]' if action.nargs in ('?', '*') else name


def _names(action: argparse.Action) -> str:
    words = ', '.join(action.option_strings) or _positional(action)
    takes = action.option_strings and action.nargs != 0
    many = ' ...' if action.nargs in ('+', '*') else ''
    if not takes or isinstance(action, argparse.BooleanOptionalAction):
        return f'`{words}`'
    return f'`{words} {action.metavar}{many}`'


def _cell(text: str) -> str:
    text = re.sub(r'(?<![\w-])--[a-z][\w-]*', r'`\g<0>`', text)
    return text.replace('|', r'\|').replace('*', r'\*').replace('<', '&lt;')
