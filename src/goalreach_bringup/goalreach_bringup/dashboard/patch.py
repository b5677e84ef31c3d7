"""What has to change on a page: the difference of two views."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

__all__ = ['View', 'difference']

View = Mapping[str, Mapping[str, str]]
"""By name of an element, its attributes; `text` and `html` are its content."""

_WORTH_APPENDING: Final = 32


def difference(new: View, old: View) -> dict[str, dict[str, str]]:
    """Return what turns a page that shows `old` into one that shows `new`.

    An attribute that has only grown at its end comes as `+name` with what is to be appended.
    """
    patch: dict[str, dict[str, str]] = {}
    for name, attributes in new.items():
        before = old.get(name, {})
        if attributes is before:
            continue
        changes: dict[str, str] = {}
        for key, value in attributes.items():
            shown = before.get(key)
            if value == shown:
                continue
            if _has_grown(key, value, shown):
                changes[f'+{key}'] = value[len(shown or '') :]
            else:
                changes[key] = value
        if changes:
            patch[name] = changes
    return patch


def _has_grown(key: str, value: str, shown: str | None) -> bool:
    return (
        shown is not None
        and key not in ('text', 'html')
        and len(shown) > _WORTH_APPENDING
        and value.startswith(shown)
    )
