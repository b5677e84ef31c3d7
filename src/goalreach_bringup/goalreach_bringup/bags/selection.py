"""Which topics of a graph are meant."""

from __future__ import annotations

from dataclasses import dataclass
import re

from goalreach_msgs_py.errors import ConfigurationError

__all__ = ['TopicSelection']


@dataclass(frozen=True, kw_only=True)
class TopicSelection:
    """Topics by name and by pattern; all where neither is given.

    Hidden topics, those with a part that begins with an underscore, are meant only by name.

    Attributes:
        names: Names, with or without the leading slash.
        patterns: Regular expressions that must match somewhere in the name.
        exclude: Regular expressions that must not.
    """

    names: tuple[str, ...] = ()
    patterns: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the patterns."""
        for option, patterns in (('--regex', self.patterns), ('--exclude', self.exclude)):
            for pattern in patterns:
                _require_pattern(option, pattern)

    def includes(self, topic: str) -> bool:
        """Return whether a topic is meant."""
        if topic in self.full_names:
            return True
        hidden = any(part.startswith('_') for part in topic.split('/'))
        if hidden or any(re.search(pattern, topic) for pattern in self.exclude):
            return False
        if self.patterns:
            return any(re.search(pattern, topic) for pattern in self.patterns)
        return not self.names

    @property
    def full_names(self) -> frozenset[str]:
        """The names with their leading slash."""
        return frozenset(name if name.startswith('/') else f'/{name}' for name in self.names)


def _require_pattern(option: str, pattern: str) -> None:
    try:
        re.compile(pattern)
    except re.error as error:
        raise ConfigurationError(option, pattern, f'a pattern: {error}') from None
