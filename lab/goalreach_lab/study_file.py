"""Results of a study: a file of results whose first line holds the settings of all of them."""

from collections.abc import Mapping, Sequence
import json
from pathlib import Path
from typing import Any

from goalreach_evaluation.results_file import ResultsFile
from goalreach_msgs_py.errors import FileFormatError

_SETTINGS = 'settings'


class StudyFile(ResultsFile):
    """The finished cases of a study; their file begins with a line `{"settings": {...}}`.

    Args:
        path: The file, created by the first result; None to keep results in memory only.
        key: Names of the fields that identify a case.
        settings: Values that every result depends on besides its case.

    Raises:
        FileFormatError: The file cannot be read, is not a file of such results, or its results
            were measured with other settings. It is left untouched.
    """

    def __init__(
        self, path: Path | None, *, key: Sequence[str], settings: Mapping[str, object]
    ) -> None:
        self._settings = json.loads(json.dumps(dict(settings)))
        self._found: Any = None
        super().__init__(path, key=key)
        if path is not None and (self.results or self._found is not None):
            self._require_same(path)

    def _accept(self, path: Path, number: int, values: dict[str, Any]) -> None:
        if _SETTINGS in values:
            self._found = values[_SETTINGS]
        else:
            super()._accept(path, number, values)

    def _append(self, path: Path, line: Mapping[str, Any]) -> None:
        if not path.exists() or not path.stat().st_size:
            super()._append(path, {_SETTINGS: self._settings})
        super()._append(path, line)

    def _require_same(self, path: Path) -> None:
        """Refuse results of other settings, naming the first that differs."""
        found = self._found
        if not isinstance(found, dict):
            raise FileFormatError(path, f'{_SETTINGS} = {found!r}: must be {self._settings!r}')
        for name in {**found, **self._settings}:
            old, new = found.get(name), self._settings.get(name)
            if old != new:
                reason = f'holds results of {name} = {old!r}, not {new!r}: use another file'
                raise FileFormatError(path, reason)
