"""A command of the command line: summary, options, function; and the parser made from them."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

from goalreach_msgs_py.errors import one_line
from goalreach_msgs_py.options import CommandOptions, SeededOptions, add_options, read_options


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command, or one of its sub-commands.

    Attributes:
        summary: One line for the help.
        options: Dataclass of its options; not a `CommandOptions` where another program parses.
        execute: Runs it with those options and returns the exit status; None where a sub-command
            must be chosen.
        subcommands: Sub-commands by name.
    """

    summary: str
    options: type[Any] = CommandOptions
    execute: Callable[[Any], int] | None = None
    subcommands: Mapping[str, Command] = field(default_factory=dict)

    @classmethod
    def of_module(cls, module: ModuleType) -> Command:
        """Return the command of a module with `SUMMARY`, and `Options` and `execute`.

        A module with sub-commands has `SUBCOMMANDS`, a mapping of names to commands.
        """
        return cls(
            summary=module.SUMMARY,
            options=getattr(module, 'Options', CommandOptions),
            execute=getattr(module, 'execute', None),
            subcommands=getattr(module, 'SUBCOMMANDS', {}),
        )

    def parser(self, program: str) -> argparse.ArgumentParser:
        """Return the parser of the command and its sub-commands; its usage names the program."""
        parser = argparse.ArgumentParser(prog=program, description=self.summary)
        self.add_to(parser)
        if self.subcommands:
            choice = parser.add_subparsers(metavar='COMMAND', required=self.execute is None)
            for name, command in self.subcommands.items():
                about = command.summary
                command.add_to(choice.add_parser(name, help=about, description=about))
        return parser

    def add_to(self, parser: argparse.ArgumentParser) -> None:
        """Add the options of the command to a parser that then chooses it."""
        parser.set_defaults(chosen_command=self)
        add_options(parser, self.options)
        parses = issubclass(self.options, CommandOptions)
        if parses and not issubclass(self.options, SeededOptions):
            text = 'accepted by every command; nothing is random in this one'
            parser.add_argument(
                '--seed', type=int, default=argparse.SUPPRESS, metavar='N', help=text
            )

    def parse(self, program: str, arguments: Sequence[str]) -> tuple[Command, Any]:
        """Parse arguments; return the command or the chosen sub-command, and its options.

        Raises:
            ConfigurationError: An option is refused.
        """
        parser = self.parser(program)
        namespace, unknown = parser.parse_known_args(arguments)
        if unknown:
            parser.error(one_line(f'unrecognized arguments: {" ".join(unknown)}'))
        chosen: Command = namespace.chosen_command
        return chosen, read_options(chosen.options, namespace)

    def run(self, program: str, arguments: Sequence[str]) -> int:
        """Parse arguments and execute the command; return the exit status.

        Raises:
            GoalreachError: An option is refused, or the command fails.
        """
        chosen, options = self.parse(program, arguments)
        return 0 if chosen.execute is None else chosen.execute(options)
