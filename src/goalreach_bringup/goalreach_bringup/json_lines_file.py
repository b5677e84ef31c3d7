"""Files that grow by one line of JSON for each result, so that a study goes on where it ended."""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
import json
from pathlib import Path
from typing import Any

from goalreach_msgs_py.errors import FileFormatError

__all__ = ['append_line', 'read_lines']


def append_line(path: Path, values: Mapping[str, object]) -> None:
    """Append values to a file as one line of JSON.

    Raises:
        FileFormatError: It cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open('a', encoding='utf-8') as stream:
            stream.write(json.dumps(dict(values)) + '\n')
    except OSError as error:
        raise FileFormatError(path, f'cannot be written: {error.strerror}') from None


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Return the lines of such a file; none where it is not there, whole ones only."""
    lines = []
    if path.exists():
        for line in path.read_text(encoding='utf-8', errors='replace').splitlines():
            with contextlib.suppress(ValueError):
                lines.append(json.loads(line))
    return lines
