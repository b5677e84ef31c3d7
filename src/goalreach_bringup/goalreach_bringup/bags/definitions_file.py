"""Message definitions as rosbag2 stores them: the installed `.msg` files, joined."""

from __future__ import annotations

from functools import lru_cache
import os
from pathlib import Path
import re
import sys
from typing import Final

from goalreach_msgs_py.errors import GoalreachError

__all__ = ['message_definition']

_SEPARATOR: Final = 80 * '='
_FIELD: Final = re.compile(r'^\s*([A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+\w+', re.MULTILINE)
_BUILT_IN: Final = re.compile(r'^(?:bool|byte|char|w?string|float\d+|u?int\d+)$')
_PARTS: Final = 3


@lru_cache(maxsize=256)
def message_definition(type_name: str) -> str:
    """Return a message's definition, followed by those of all that it is made of.

    Args:
        type_name: `package/msg/Name`.

    Raises:
        GoalreachError: The package is not installed, or brings no `.msg` file.
    """
    parts = type_name.split('/')
    if len(parts) != _PARTS or parts[1] != 'msg':
        raise GoalreachError(f'{type_name}: is not the name of a message')
    seen: set[str] = set()
    return _full_text(parts[0], parts[2], seen)


def _full_text(package: str, name: str, seen: set[str]) -> str:
    text = _read(package, name)
    result = text
    for inner_package, inner in sorted(_made_of(package, text)):
        full_name = f'{inner_package}/{inner}'
        if full_name not in seen:
            seen.add(full_name)
            result += f'\n{_SEPARATOR}\nMSG: {full_name}\n'
            result += _full_text(inner_package, inner, seen)
    return result


def _made_of(package: str, text: str) -> set[tuple[str, str]]:
    found = set()
    for name in _FIELD.findall(re.sub(r'#.*', '', text)):
        if not _BUILT_IN.match(name):
            parts = name.split('/')
            owner = package if len(parts) == 1 else parts[0]
            found.add((owner, parts[-1]))
    return found


def _read(package: str, name: str) -> str:
    prefixes = [*os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    for prefix in filter(None, prefixes):
        path = Path(prefix) / 'share' / package / 'msg' / f'{name}.msg'
        try:
            return path.read_text(encoding='utf-8')
        except OSError:
            continue
    raise GoalreachError(f'{package}/msg/{name}: its definition is not installed')
