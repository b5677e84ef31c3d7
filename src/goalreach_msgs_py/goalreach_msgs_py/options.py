"""Command-line options as frozen dataclasses: one declaration gives parser, help and value.

The annotation of a field decides how it is parsed: `bool` is a flag, `bool | None` a pair
`--x/--no-x`, `tuple[T, ...]` takes several values, `T | None` may be left out. A field whose
default factory is a dataclass is a group: its options are added to those of the whole.
"""

import argparse
from collections.abc import Callable, Iterator
import dataclasses
from dataclasses import MISSING, dataclass
import re
import types
import typing
from typing import Any, Final, TypeVar, cast

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import KINDS, ParameterInfo, check_value

OptionsT = TypeVar('OptionsT')
REQUIRED: Final = MISSING
"""Default of an option that must be given."""

_KEY: Final = 'goalreach.option'
_METAVARS: Final = {'int': 'N', 'float': 'F', 'Path': 'FILE', 'str': 'TEXT'}


@dataclass(frozen=True, kw_only=True)
class OptionInfo(ParameterInfo):
    """Description of one option.

    Attributes:
        flag: Name on the command line, or empty for the field's own.
        aliases: Further names on the command line, as another program has them.
        metavar: Placeholder of the value in the help, or empty for that of its type.
        positional: Whether it is given by position, without a flag.
        repeatable: Whether a tuple grows by one value each time the flag is given.
        empty: Whether a flag that takes several values may be given without any.
        remainder: Whether it takes all arguments that are left, flags included.
        hidden: Whether the help leaves it out.
        names: Values that completion offers, where others are allowed, too.
        parse: Converts the text of one value, or None for the type's own constructor.
    """

    flag: str = ''
    aliases: tuple[str, ...] = ()
    metavar: str = ''
    positional: bool = False
    repeatable: bool = False
    empty: bool = False
    remainder: bool = False
    hidden: bool = False
    names: tuple[str, ...] = ()
    parse: Callable[[str], object] | None = None


def option(
    default: Any,  # noqa: ANN401 - the field's own annotation gives the type
    description: str,
    **settings: Any,  # noqa: ANN401 - attributes of OptionInfo
) -> Any:  # noqa: ANN401 - what dataclasses.field itself returns
    """Return a dataclass field that is an option of a command; `default` may be `REQUIRED`.

    The default is appended to the help text where there is one to show. Settings are attributes
    of `OptionInfo`, such as `minimum`, `choices` or `metavar`.
    """
    info = OptionInfo(description=description, **settings)
    return dataclasses.field(default=default, metadata={_KEY: info})


@dataclass(frozen=True, kw_only=True)
class CommandOptions:
    """Base class of the options of a command: checks ranges and choices when it is made.

    A subclass with further checks calls `super().__post_init__()` first.
    """

    def __post_init__(self) -> None:
        """Check every option.

        Raises:
            ConfigurationError: A value is out of its range or not among its choices.
        """
        for name, one in _parts_of(type(self)):
            if isinstance(one, _Option):
                value = getattr(self, name)
                for element in value if one.many else [value]:
                    if element is not None:
                        check_value(one.name, element, one.info, one.base)


@dataclass(frozen=True, kw_only=True)
class SeededOptions(CommandOptions):
    """Base class of the options of a command that draws random numbers."""

    seed: int = option(0, 'seed of everything random, for a repeatable run', minimum=0)


@dataclass(frozen=True, kw_only=True)
class _Option:
    """A field of an options class, with its annotation resolved."""

    field: dataclasses.Field[Any]
    info: OptionInfo
    base: type[Any]
    optional: bool
    many: bool

    @property
    def name(self) -> str:
        """Name in messages: the flag, or the placeholder of a positional."""
        if self.info.positional:
            return self.info.metavar or self.field.name
        return self.info.flag or '--' + self.field.name.replace('_', '-')

    def convert(self, text: str) -> object:
        """Return the value of a text.

        Raises:
            ConfigurationError: The text is not of the type.
        """
        try:
            return (self.info.parse or self.base)(text)
        except ValueError:
            allowed = self.info.allowed(KINDS.get(self.base, 'valid'))
            raise ConfigurationError(self.name, text, allowed) from None

    def add_to(self, parser: argparse.ArgumentParser, dest: str) -> None:
        """Add the option to a parser; what is not given is left out of the namespace."""
        settings: dict[str, Any] = {'help': self._help(), 'default': argparse.SUPPRESS}
        if self.base is bool:
            settings['action'] = argparse.BooleanOptionalAction if self.optional else 'store_true'
        else:
            settings |= {'type': self.convert, 'metavar': self._metavar(), 'nargs': self._nargs()}
        if self.info.positional:
            parser.add_argument(dest, **{**settings, 'default': None})
            return
        if self.info.repeatable:
            settings['action'] = 'append'
        settings['required'] = self.field.default is MISSING
        parser.add_argument(self.name, *self.info.aliases, dest=dest, **settings)

    def _help(self) -> str:
        if self.info.hidden:
            return argparse.SUPPRESS
        default, text = self.field.default, self.info.description
        if default is MISSING or default is None or default is False or default in ('', ()):
            shown = ''
        else:
            words = default if isinstance(default, tuple) else (default,)
            shown = f' (default: {" ".join(map(str, words))})'
        return (text + shown).replace('%', '%%')

    def _metavar(self) -> str:
        choices = '{' + ','.join(self.info.choices) + '}' if self.info.choices else ''
        return self.info.metavar or choices or _METAVARS.get(self.base.__name__, 'VALUE')

    def _nargs(self) -> str | None:
        if self.info.remainder:
            return argparse.REMAINDER
        if self.many and not self.info.repeatable:
            return '*' if self.info.empty else '+'
        return '?' if self.info.positional and self.field.default is not MISSING else None


def _parts_of(cls: type[object]) -> Iterator[tuple[str, _Option | type[object]]]:
    """Yield the fields of a class that are options, or groups of them."""
    hints = typing.get_type_hints(cls)
    for field in dataclasses.fields(cast('Any', cls)):
        if dataclasses.is_dataclass(group := field.default_factory):
            yield field.name, cast('type[object]', group)
        if _KEY not in field.metadata:
            continue
        hint, optional = hints[field.name], False
        if typing.get_origin(hint) in (types.UnionType, typing.Union):
            hint = next(part for part in typing.get_args(hint) if part is not types.NoneType)
            optional = True
        many = typing.get_origin(hint) is tuple
        base = typing.get_args(hint)[0] if many else hint
        info = field.metadata[_KEY]
        yield field.name, _Option(field=field, info=info, base=base, optional=optional, many=many)


def add_options(parser: argparse.ArgumentParser, cls: type[object], prefix: str = '') -> None:
    """Add the options of a class, and of the groups in it, to a parser.

    Their names in the namespace begin with the prefix, as in `read_options`.
    """
    for name, part in _parts_of(cls):
        if isinstance(part, _Option):
            part.add_to(parser, prefix + name)
        else:
            add_options(parser, part, f'{prefix}{name}.')


def read_options(cls: type[OptionsT], namespace: argparse.Namespace, prefix: str = '') -> OptionsT:
    """Return the options that were parsed; those not given keep their defaults.

    Raises:
        ConfigurationError: A value is refused; the error names the flag.
    """
    values: dict[str, Any] = {}
    for name, part in _parts_of(cls):
        if not isinstance(part, _Option):
            values[name] = read_options(part, namespace, f'{prefix}{name}.')
        elif (value := getattr(namespace, prefix + name, None)) is not None:
            values[name] = tuple(value) if part.many else value
    return cls(**values)


def parse_namespace(text: str, flag: str = '--namespace') -> str:
    """Return a namespace without its leading slash."""
    if not re.fullmatch(r'/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*', text, re.ASCII):
        raise ConfigurationError(flag, text, 'a ROS 2 namespace such as robot1')
    return text.removeprefix('/')
