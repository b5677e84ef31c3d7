"""Files: atomic writing, checks before work begins, safe loading of untrusted YAML and JSON."""

import contextlib
import json
import os
from pathlib import Path
import stat
import tempfile
from typing import Any, Final

import yaml

from goalreach_msgs_py.errors import FileFormatError, GoalreachError

_READABLE = 0o644
_MAXIMUM_DEPTH: Final = 100
"""Nested brackets; no file of ours has ten. The time to parse grows with their square. Chosen."""


def make_folder(folder: Path) -> None:
    """Make a folder and its parents, unless they exist.

    Raises:
        FileFormatError: The folder cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileFormatError(folder, f'cannot be made: {error.strerror}') from None


def require_writable(path: str | Path) -> None:
    """Check that a file can be written, before the work whose result it will hold.

    Raises:
        FileFormatError: The path is a folder, or its folder does not exist or is read-only.
    """
    target = Path(path)
    if target.is_dir():
        raise FileFormatError(path, 'cannot be written: is a directory')
    if not target.parent.is_dir():
        raise FileFormatError(path, f'cannot be written: {target.parent} is no directory')
    if not os.access(target.parent, os.W_OK):
        raise FileFormatError(path, f'cannot be written: {target.parent} is read-only')


def write_text_atomically(path: str | Path, text: str) -> None:
    """Write a UTF-8 text file through a temporary file and a rename.

    Raises:
        FileFormatError: The file cannot be written; its previous content is untouched.
    """
    write_bytes_atomically(path, text.encode())


def write_bytes_atomically(path: str | Path, content: bytes) -> None:
    """Write a file through a temporary file in the same folder and a rename; a pipe as it is.

    Raises:
        FileFormatError: The file cannot be written; its previous content is untouched.
    """
    target, mode = Path(os.path.realpath(path)), _READABLE
    try:
        if target.exists():
            mode = stat.S_IMODE(target.stat().st_mode)
            if not target.is_file():
                target.write_bytes(content)
                return
        descriptor, temporary = tempfile.mkstemp(dir=target.parent, prefix=f'.{target.name}.')
    except OSError as error:
        raise FileFormatError(path, f'cannot be written: {error.strerror}') from None
    try:
        with os.fdopen(descriptor, 'wb') as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        Path(temporary).chmod(mode)
        Path(temporary).replace(target)
    except BaseException as error:
        with contextlib.suppress(OSError):
            Path(temporary).unlink()
        if not isinstance(error, OSError):
            raise
        raise FileFormatError(path, f'cannot be written: {error.strerror}') from None


def read_text(path: str | Path) -> str:
    """Return the text of a UTF-8 file.

    Raises:
        FileFormatError: The file cannot be read or is not UTF-8 text.
    """
    try:
        return Path(path).read_text(encoding='utf-8')
    except OSError as error:
        raise FileFormatError(path, f'cannot be read: {error.strerror}') from None
    except UnicodeDecodeError:
        raise FileFormatError(path, 'is not UTF-8 text') from None


def read_json(path: str | Path) -> Any:  # noqa: ANN401
    """Return the document of an untrusted JSON file.

    Raises:
        FileFormatError: The file cannot be read, is not UTF-8 text or not JSON.
    """
    try:
        return json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise FileFormatError(path, f'is not JSON: {error}') from None


def read_yaml(path: str | Path, loader: type[yaml.SafeLoader] = yaml.SafeLoader) -> Any:  # noqa: ANN401
    """Return the document of an untrusted YAML file, by a safe loader.

    Raises:
        FileFormatError: The file cannot be read, is not UTF-8 text or not YAML.
    """
    try:
        return load_yaml(read_text(path), loader)
    except yaml.YAMLError as error:
        mark = getattr(error, 'problem_mark', None)
        reason = str(error).partition('\n')[0]
        place = f': {reason}' if mark is None else f' at line {mark.line + 1}'
        raise FileFormatError(path, f'is not YAML{place}') from None


def load_yaml(text: str, loader: type[yaml.SafeLoader] = yaml.SafeLoader) -> Any:  # noqa: ANN401
    """Return the document of an untrusted YAML text, by a safe loader.

    Raises:
        yaml.YAMLError: The text is not YAML, holds an impossible value, or is nested too deeply.
    """
    _check_depth(text)
    try:
        return yaml.load(text, loader)  # noqa: S506 - a safe loader, by its type
    except (GoalreachError, yaml.YAMLError):
        raise
    except Exception as error:  # noqa: BLE001 - a value that its tag does not fit leads to any
        raise yaml.YAMLError(str(error)) from None


def _check_depth(text: str) -> None:
    depth = 0
    for character in text:
        if character in '[{':
            depth += 1
            if depth > _MAXIMUM_DEPTH:
                raise yaml.YAMLError('nested too deeply')
        elif character in ']}':
            depth = max(0, depth - 1)
