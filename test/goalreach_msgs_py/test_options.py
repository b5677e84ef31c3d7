"""Options declared once: parser, help and value."""

import argparse
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.options import (
    REQUIRED,
    CommandOptions,
    SeededOptions,
    add_options,
    option,
    read_options,
)


def _pair(text: str) -> tuple[int, int]:
    first, second = text.split(',')
    return int(first), int(second)


@dataclass(frozen=True, kw_only=True)
class Selection:
    names: tuple[str, ...] = option((), 'topics', flag='--topics', metavar='NAME')
    exclude: tuple[str, ...] = option((), 'leave out', repeatable=True)


@dataclass(frozen=True, kw_only=True)
class Options(SeededOptions):
    bag: Path = option(REQUIRED, 'the bag', positional=True, metavar='DIR')
    other: Path | None = option(None, 'a second bag', positional=True)
    selection: Selection = field(default_factory=Selection)
    paths: int = option(3, 'number of paths', minimum=1, maximum=9)
    rate: float = option(1.0, '100 % is the recorded rate', above=0.0)
    mode: str = option('a', 'mode', choices=('a', 'b'))
    quiet: bool = option(False, 'say less')
    page: bool | None = option(None, 'show the page')
    out: Path | None = option(None, 'file to write')
    pairs: tuple[tuple[int, int], ...] = option(
        ((1, 2),), 'pairs', flag='--pair', repeatable=True, parse=_pair
    )
    numbers: tuple[int, ...] = option((7, 8), 'numbers', empty=True, minimum=0)
    secret: int = option(0, 'internal', hidden=True)


@dataclass(frozen=True, kw_only=True)
class Needed(CommandOptions):
    results: Path = option(REQUIRED, 'where results go')


@dataclass(frozen=True, kw_only=True)
class Rest(CommandOptions):
    arguments: tuple[str, ...] = option((), 'all', positional=True, remainder=True)


def parse(*words: str, cls: type[Any] = Options) -> Any:  # noqa: ANN401
    parser = argparse.ArgumentParser()
    add_options(parser, cls)
    return read_options(cls, parser.parse_args(words))


def test_what_is_not_given_keeps_its_default() -> None:
    assert parse('x') == Options(bag=Path('x'))
    assert parse(cls=Rest) == Rest()


@pytest.mark.parametrize(
    ('words', 'expected'),
    [
        ('--seed 5', {'seed': 5}),
        ('y', {'other': Path('y')}),
        ('--paths 9 --rate 0.5 --mode b', {'paths': 9, 'rate': 0.5, 'mode': 'b'}),
        ('--quiet --page', {'quiet': True, 'page': True}),
        ('--no-page --out f', {'page': False, 'out': Path('f')}),
        ('--pair 3,4 --pair 5,6', {'pairs': ((3, 4), (5, 6))}),
        ('--numbers', {'numbers': ()}),
        ('--numbers 1 2 --secret 4', {'numbers': (1, 2), 'secret': 4}),
        (
            '--topics /a /b --exclude c --exclude d',
            {'selection': Selection(names=('/a', '/b'), exclude=('c', 'd'))},
        ),
    ],
)
def test_every_kind_of_option(words: str, expected: dict[str, Any]) -> None:
    assert parse('x', *words.split()) == Options(bag=Path('x'), **expected)


def test_a_remainder_takes_flags_too() -> None:
    assert parse('topic', '--once', '--help', cls=Rest).arguments == ('topic', '--once', '--help')


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        ('--paths x', "--paths = 'x': must be a whole number in [1, 9]"),
        ('--paths 0', '--paths = 0: must be a whole number in [1, 9]'),
        ('--seed -1', '--seed = -1: must be a whole number >= 0'),
        ('--rate 0', '--rate = 0.0: must be greater than 0'),
        ('--rate nan', '--rate = nan: must be a number'),
        ('--mode c', "--mode = 'c': must be one of a, b"),
        ('--pair 3', "--pair = '3': must be valid"),
        ('--numbers 1 -2', '--numbers = -2: must be a whole number >= 0'),
    ],
)
def test_a_refused_value_is_named_with_its_flag(words: str, message: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        parse('x', *words.split())
    assert str(caught.value) == message


def test_values_given_in_code_are_checked_as_well() -> None:
    with pytest.raises(ConfigurationError, match=r'--paths = 10: must be'):
        Options(bag=Path('x'), paths=10)


@pytest.mark.parametrize(('cls', 'words'), [(Options, ''), (Needed, '')])
def test_a_required_option_is_required(
    cls: type[Any], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        parse(*words.split(), cls=cls)
    assert 'required' in capsys.readouterr().err


def test_help_shows_defaults_choices_and_placeholders() -> None:
    parser = argparse.ArgumentParser()
    add_options(parser, Options)
    text = ' '.join(parser.format_help().split())
    assert '--paths N number of paths (default: 3)' in text
    assert '--mode {a,b} mode (default: a)' in text
    assert '--rate F 100 % is the recorded rate (default: 1.0)' in text
    assert '--numbers [N ...] numbers (default: 7 8)' in text
    assert 'say less --page' in text
    assert '--out FILE file to write --pair' in text
    assert 'secret' not in text
