"""The kinds of fault: what is done, the expected behaviour, and the words that report it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.files import read_yaml


@dataclass(frozen=True, kw_only=True)
class FaultKind:
    """One kind of fault.

    Attributes:
        name: A short description.
        act: Method of the injector that does it.
        target: Node, topic or parameter that it affects.
        amount: Seconds, a share, or a value of the parameter.
        duration_s: Duration, seconds of the graph's clock; 0 for an event.
        expected: Expected behaviour of the stack.
        report_pattern: Regular expression of the words that report it.
        words: Arguments of `goalreach run` for the stack that it needs; empty: the usual one.
        ends_paths: Whether a path usually ends in it, by a bump or because it lasts so long: the
            recovery time counts nevertheless.
    """

    name: str
    act: str
    target: str = ''
    amount: float = 0.0
    duration_s: float = 2.0
    expected: str = 'the robot stops while it lasts, then drives on'
    report_pattern: str
    words: str = ''
    ends_paths: bool = False


def _read() -> Iterator[FaultKind]:
    here = Path(__file__).parent
    for kind in read_yaml(here / 'kinds.yaml'):
        for target in kind.pop('targets', [kind.get('target', '')]):
            texts = {
                name: text.replace('{target}', target).replace('{here}', str(here))
                for name, text in kind.items()
                if type(text) is str
            }
            yield FaultKind(**{**kind, **texts, 'target': target})


KINDS: Final = tuple(_read())
"""All kinds, in the order of the table."""


def choose_kinds(words: str) -> tuple[FaultKind, ...]:
    """Return the kinds whose name holds one of the words, separated by commas; all for none.

    Raises:
        ConfigurationError: No kind holds one of them.
    """
    wanted = [word.strip() for word in words.split(',') if word.strip()]
    if not wanted:
        return KINDS
    for word in wanted:
        if not any(word in kind.name for kind in KINDS):
            raise ConfigurationError('--kinds', word, 'a word of the name of a kind of fault')
    return tuple(kind for kind in KINDS if any(word in kind.name for word in wanted))
