"""YAML of strangers: plain values only, in bounded time, and one kind of error."""

from __future__ import annotations

from typing import Any, Final

import yaml

__all__ = ['load_yaml']

_DEEPEST: Final = 100
"""Brackets in one another; no file of ours has ten. The time to read grows with their square."""


def load_yaml(text: str, loader: type[yaml.SafeLoader] = yaml.SafeLoader) -> Any:  # noqa: ANN401
    """Return the document of a text.

    Args:
        text: YAML.
        loader: A safe loader.

    Raises:
        yaml.YAMLError: It is not YAML, holds what cannot be a value, or is nested too deeply.
    """
    _check_depth(text)
    try:
        return yaml.load(text, loader)  # noqa: S506 - a safe loader, by its type
    except (ValueError, OverflowError, RecursionError, TypeError) as error:
        raise yaml.YAMLError(str(error)) from None


def _check_depth(text: str) -> None:
    depth = 0
    for character in text:
        if character in '[{':
            depth += 1
            if depth > _DEEPEST:
                raise yaml.YAMLError('nested too deeply')
        elif character in ']}':
            depth = max(0, depth - 1)
