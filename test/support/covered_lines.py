"""A plugin of pytest that counts the lines of src that run in its process, for the gate.

SlipCover takes its probes out of the code once a line has run, and so costs little; before Python
3.12, coverage.py takes twice the time. One process of pytest imports the package under test from
`src` and the others from where colcon installed them: modules are told by package and path in it.
"""

from collections.abc import Mapping, Sequence
import json
import os
from pathlib import Path
from typing import Any

import slipcover

VARIABLE = 'GOALREACH_COVERED_LINES'
"""Names the folder in which each process writes its lines; without it nothing is counted."""


class _Sources:
    def matches(self, path: str | Path | None) -> bool:
        """Return whether the lines of a file are counted."""
        return path is not None and module_of(Path(path)) is not None


def module_of(path: Path) -> str | None:
    """Return the package and the path in it of a module of src, or None of any other file."""
    parts = path.parts
    for above in ('site-packages', 'src'):
        if above in parts:
            inner = parts[len(parts) - parts[::-1].index(above) + (above == 'src') :]
            if inner and inner[0].startswith('goalreach') and path.suffix == '.py':
                return '/'.join(inner)
    return None


def percent(folder: Path, root: Path) -> float:
    """Return the share of the lines of src that ran in any process.

    Args:
        folder: What the processes wrote.
        root: Root of the repository; modules that no process imported count as well.
    """
    ran: set[tuple[str, int]] = set()
    for path in folder.glob('*.json'):
        lines: Mapping[str, Sequence[int]] = json.loads(path.read_text())
        ran.update((module, line) for module, numbers in lines.items() for line in numbers)
    unseen = slipcover.Slipcover(source=[str(root / 'src')]).get_coverage()['files']
    every = {
        (module_of((root / name).resolve()), line)
        for name, lines in unseen.items()
        for line in lines['missing_lines']
        if module_of((root / name).resolve())
    }
    return 100.0 * len(ran & every) / len(every)


if VARIABLE in os.environ:
    _COUNTER = slipcover.Slipcover()
    slipcover.ImportManager(_COUNTER, _Sources()).__enter__()

    def pytest_sessionfinish() -> None:
        """Write which lines ran."""
        files: dict[str, Any] = _COUNTER.get_coverage()['files']
        ran = {module_of(Path(p).resolve()): lines['executed_lines'] for p, lines in files.items()}
        folder = Path(os.environ[VARIABLE])
        folder.mkdir(exist_ok=True)
        (folder / f'{os.getpid()}.json').write_text(json.dumps(ran))
