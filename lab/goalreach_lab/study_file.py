"""Results of a study, each with the version of the code that made it."""

from collections import Counter
from collections.abc import Mapping, Sequence
import functools
import importlib.metadata
import json
from pathlib import Path
import subprocess
import sys
from typing import Any

from goalreach_evaluation.results_file import ResultsFile
from goalreach_msgs_py.errors import FileFormatError

_SETTINGS, _MADE_BY = 'settings', 'made_by'
_ROOT = Path(__file__).resolve().parents[2]


@functools.cache
def code_version(*folders: str) -> str:
    """Return the commit that last changed some folders, with `+` where they were changed since.

    Without git it is the version of the package.
    """
    commands = (['log', '-1', '--format=%h', '--abbrev=10'], ['status', '--porcelain', '-uno'])
    try:
        commit, changed = (
            subprocess.check_output(
                ['git', '-C', _ROOT, *words, '--', *folders], stderr=subprocess.DEVNULL, text=True
            ).strip()
            for words in commands
        )
        return commit + '+' * bool(changed)
    except (OSError, subprocess.CalledProcessError):
        installed = importlib.metadata.distributions(name='goalreach')
        return next((one.version for one in installed), 'unknown')


class StudyFile(ResultsFile):
    """The finished cases of a study; their file begins with a line `{"settings": {...}}`.

    Each result is kept with what made it: the version of the code, and the seed if it is given.

    Args:
        path: The file, created by the first result; None to keep results in memory only.
        key: Names of the fields that identify a case.
        settings: Values that every result depends on besides its case.
        seed: A seed that the settings do not hold.

    Raises:
        FileFormatError: The file cannot be read, is not a file of such results, or its results
            were measured with other settings. It is left untouched.
    """

    def __init__(
        self,
        path: Path | None,
        *,
        key: Sequence[str],
        settings: Mapping[str, object],
        seed: int | None = None,
    ) -> None:
        self._maker = code_version('src', 'lab', 'examples')
        self._maker += '' if seed is None else f', seed {seed}'
        self._makers: Counter[str] = Counter()
        self._settings = json.loads(json.dumps(dict(settings)))
        self._found: Any = None
        super().__init__(path, key=key)
        if path is not None and (self.results or self._found is not None):
            self._require_same(path)

    def _accept(self, path: Path, number: int, values: dict[str, Any]) -> None:
        if _SETTINGS in values:
            self._found = values[_SETTINGS]
        else:
            self._makers[str(values.pop(_MADE_BY, 'unknown'))] += 1
            super()._accept(path, number, values)

    def _append(self, path: Path, line: Mapping[str, Any]) -> None:
        if not path.exists() or not path.stat().st_size:
            super()._append(path, {_SETTINGS: self._settings})
        super()._append(path, {**line, _MADE_BY: self._maker})

    def tell_others(self) -> None:
        """Tell of the results that other code or another seed has made."""
        others = ', '.join(
            f'{n} by {one}' for one, n in self._makers.items() if one != self._maker
        )
        if others:
            sys.stderr.write(f'{self._path}: holds results made {others}; now {self._maker}\n')

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
