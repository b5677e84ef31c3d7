"""The option `--arena` and the arenas that come with the project."""

from __future__ import annotations

import argparse
from importlib import resources
from pathlib import Path

__all__ = ['add_arena_option', 'arena_names', 'arena_path']

_SUFFIX = '.yaml'


def add_arena_option(parser: argparse.ArgumentParser) -> None:
    """Add `--arena` to a command."""
    text = f'where to drive: {", ".join(arena_names())}, or a YAML file'
    parser.add_argument('--arena', default='paper', metavar='NAME|FILE', help=text)


def arena_names() -> list[str]:
    """Return the names of the arenas that come with the project."""
    return sorted(path.stem for path in _folder().glob(f'*{_SUFFIX}'))


def arena_path(name: str) -> Path:
    """Return the file of an arena that comes with the project.

    Args:
        name: One of `arena_names`.
    """
    return _folder() / f'{name}{_SUFFIX}'


def _folder() -> Path:
    return Path(str(resources.files('goalreach_bringup'))) / 'config' / 'arenas'
