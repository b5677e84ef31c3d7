"""Results of long measurements: JSON lines, one per finished case, appended as each finishes."""

from collections.abc import Mapping, Sequence
import json
from pathlib import Path
from typing import Any, TypeVar

from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.files import make_folder

_Case = TypeVar('_Case', bound=Mapping[str, Any])


class ResultsFile:
    """The finished cases of a measurement, kept so that an interrupted one can resume.

    Each line is a JSON object that holds the key fields of a case and its result. The file is only
    ever appended to, one line in one write, also by several processes; a line that a killed
    process left incomplete is ignored, so that its case counts as not measured.

    Args:
        path: The file, created by the first result; None to keep results in memory only.
        key: Names of the fields that identify a case.

    Raises:
        FileFormatError: The file cannot be read, or is not a file of such results. It is left
            untouched.
    """

    def __init__(self, path: Path | None, *, key: Sequence[str]) -> None:
        self._path = path
        self._key = tuple(key)
        self._results: dict[tuple[object, ...], dict[str, Any]] = {}
        if path is not None and path.exists():
            self._read(path)

    @property
    def results(self) -> list[dict[str, Any]]:
        """Key fields and result of every finished case, in the order of the file."""
        return list(self._results.values())

    def select(self, cases: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
        """Return key fields and result of those cases that are finished, in the order given."""
        found = (self._results.get(self._identity(case)) for case in cases)
        return [result for result in found if result is not None]

    def missing(self, cases: Sequence[_Case]) -> list[_Case]:
        """Return the cases that are not finished, in the order given."""
        return [case for case in cases if self._identity(case) not in self._results]

    def add(self, case: Mapping[str, Any], result: Mapping[str, Any]) -> None:
        """Keep the result of a finished case: JSON-ready fields, with the key fields of the case.

        Raises:
            FileFormatError: The file cannot be written.
        """
        line = {**{name: case[name] for name in self._key}, **result}
        if self._path is not None:
            self._append(self._path, line)
        self._results[self._identity(line)] = json.loads(json.dumps(line))

    def _identity(self, case: Mapping[str, Any]) -> tuple[object, ...]:
        return tuple(case[name] for name in self._key)

    def _read(self, path: Path) -> None:
        try:
            text = path.read_text(encoding='utf-8', errors='replace')
        except OSError as error:
            raise FileFormatError(path, f'cannot be read: {error.strerror}') from None
        for number, line in enumerate(text.splitlines(), start=1):
            if line and not line.startswith('{'):
                raise FileFormatError(path, f'line {number}: is not a JSON object')
            try:
                values = json.loads(line)
            except (ValueError, RecursionError):  # a killed process left the line incomplete
                continue
            self._accept(path, number, values)

    def _accept(self, path: Path, number: int, values: dict[str, Any]) -> None:
        """Keep what a line of the file holds."""
        for name in self._key:
            if name not in values:
                raise FileFormatError(path, f'line {number}: {name} is missing')
            if isinstance(values[name], list | dict):
                raise FileFormatError(path, f'line {number}: {name} = {values[name]!r}')
        self._results[self._identity(values)] = values

    def _append(self, path: Path, line: Mapping[str, Any]) -> None:
        lines = [json.dumps(line), '']
        make_folder(path.parent)
        try:
            with path.open('ab+') as stream:
                if stream.seek(0, 2) > 0:
                    stream.seek(-1, 2)
                    if stream.read() != b'\n':
                        lines.insert(0, '')
                stream.write('\n'.join(lines).encode())
        except OSError as error:
            raise FileFormatError(path, f'cannot be written: {error.strerror}') from None
