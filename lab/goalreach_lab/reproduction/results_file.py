"""Results of studies on disk, session by session, so that a study goes on where it ended."""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
from dataclasses import asdict
import json
from pathlib import Path
from typing import Any

from goalreach_evaluation.summary_file import append_line, read_lines
from goalreach_lab.reproduction.study import DrivenPath
from goalreach_msgs_py.files import make_folder, write_text_atomically


class ResultsFolder:
    """A folder with one file of JSON lines per study, and one JSON file per other result.

    Args:
        folder: Where; made if it is not there.

    Raises:
        FileFormatError: It cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        make_folder(folder)

    def sessions(self, name: str) -> dict[int, list[DrivenPath]]:
        """Return the sessions of a study that were driven; a line cut off counts as not driven.

        Args:
            name: Name of the study.
        """
        found: dict[int, list[DrivenPath]] = {}
        for entry in read_lines(self._lines(name)):
            with contextlib.suppress(ValueError, KeyError, TypeError):
                found[int(entry['session'])] = [DrivenPath(**one) for one in entry['paths']]
        return found

    def add_session(self, name: str, number: int, paths: Sequence[DrivenPath]) -> None:
        """Keep a driven session.

        Args:
            name: Name of the study.
            number: Number of the session.
            paths: Its paths.

        Raises:
            FileFormatError: It cannot be written.
        """
        entry = {'session': number, 'paths': [asdict(path) for path in paths]}
        append_line(self._lines(name), entry)

    def read(self, name: str) -> Any:
        """Return another result, or None where there is none."""
        try:
            return json.loads((self.folder / f'{name}.json').read_text(encoding='utf-8'))
        except (OSError, ValueError):
            return None

    def write(self, name: str, result: object) -> None:
        """Keep another result.

        Raises:
            FileFormatError: It cannot be written.
        """
        write_text_atomically(self.folder / f'{name}.json', json.dumps(result, indent=1) + '\n')

    def policy_path(self, name: str) -> Path:
        """Return where a learned policy is kept."""
        return self.folder / f'{name}.policy.json'

    def _lines(self, name: str) -> Path:
        return self.folder / f'{name}.jsonl'
