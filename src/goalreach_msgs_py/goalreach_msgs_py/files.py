"""Writing a file whole or not at all, and the folder it goes to."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
import tempfile
from typing import Any, Final

import yaml

from goalreach_msgs_py.errors import FileFormatError

_READABLE = 0o644


def make_folder(folder: Path) -> None:
    """Make a folder, and those it lies in, where it is not there.

    Raises:
        FileFormatError: It cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileFormatError(folder, f'cannot be made: {error.strerror}') from None


def require_writable(path: str | Path) -> None:
    """Check that a file could be written, before the work whose result it is to hold.

    Raises:
        FileFormatError: It could not.
    """
    target = Path(path)
    if target.is_dir():
        raise FileFormatError(path, 'cannot be written: is a directory')
    if not target.parent.is_dir():
        raise FileFormatError(path, f'cannot be written: {target.parent} is no directory')
    if not os.access(target.parent, os.W_OK):
        raise FileFormatError(path, f'cannot be written: {target.parent} is read-only')


def write_text_atomically(path: str | Path, text: str) -> None:
    """Write a UTF-8 text file by way of a temporary neighbour and a rename.

    Raises:
        FileFormatError: The file cannot be written; what was there before is untouched.
    """
    write_bytes_atomically(path, text.encode())


def write_bytes_atomically(path: str | Path, content: bytes) -> None:
    """Write a file by way of a temporary neighbour and a rename.

    Raises:
        FileFormatError: The file cannot be written; what was there before is untouched.
    """
    target = Path(path)
    try:
        descriptor, temporary = tempfile.mkstemp(dir=target.parent, prefix=f'.{target.name}.')
    except OSError as error:
        raise FileFormatError(path, f'cannot be written: {error.strerror}') from None
    try:
        with os.fdopen(descriptor, 'wb') as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        Path(temporary).chmod(_READABLE)
        Path(temporary).replace(target)
    except OSError as error:
        with contextlib.suppress(OSError):
            Path(temporary).unlink()
        raise FileFormatError(path, f'cannot be written: {error.strerror}') from None


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
