"""Every study behind a document, one after another, in pieces that can be interrupted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
import subprocess
import sys
import time
from typing import Any, Final

from rich.console import Console
from rich.table import Table

from goalreach_lab.options import BenchOptions
from goalreach_lab.row import BenchRow
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.files import read_yaml
from goalreach_msgs_py.options import option

SUMMARY: Final = 'All studies of the documents, one after another; tells how long each takes'

_STUDIES: Final = Path(__file__).with_name('everything.yaml')
_ROOT: Final = Path(__file__).resolve().parents[2]
_ENDED: Final = (0, 1)  # its goals are met, or some are not


@dataclass(frozen=True, kw_only=True)
class Options(BenchOptions):
    """Options of the suite."""

    results: Path = option(
        Path('out/bench'), 'folder of logs, exit statuses and results', metavar='DIR'
    )
    resume: bool = option(False, 'leave out the studies that are finished in --results')
    study: tuple[str, ...] = option((), 'of everything.yaml (default: all)', metavar='NAME')
    as_it_is: bool = option(False, 'run nothing, only tell what is finished and what is left')


def execute(options: Options) -> list[BenchRow]:
    """Run the studies, each in a process of its own; return no rows: the documents have them.

    A study is finished once its process has ended, goals met or not: `NAME.status` in the folder
    of results then holds its exit status, its seconds and its words. One that failed, or whose
    words have changed since, runs again.

    Raises:
        GoalreachError: A study missed a goal or failed; all others were run first.
        ConfigurationError: A study does not exist, or results are there and not to be resumed.
    """
    studies = _chosen(options.study)
    done = {name: _status(options.results, name, one['words']) for name, one in studies.items()}
    begun = any((options.results / name).exists() for name in studies)
    if begun and not (options.resume or options.as_it_is):
        raise ConfigurationError('--results', options.results, 'a new folder, or with --resume')
    _tell(studies, done)
    if options.as_it_is:
        return []
    for name in studies:
        if done[name] is None:
            done[name] = _run(name, studies[name]['words'], options.results)
    missed = [name for name, status in done.items() if status and status[0]]
    if missed:
        logs = ', '.join(str(options.results / f'{name}.log') for name in missed)
        raise GoalreachError(f'goals missed, or failed: see {logs}')
    return []


def _chosen(names: Sequence[str]) -> Mapping[str, Any]:
    studies = read_yaml(_STUDIES)
    for name in names:
        if name not in studies:
            raise ConfigurationError('--study', name, 'one of ' + ', '.join(studies))
    return {name: study for name, study in studies.items() if not names or name in names}


def _status(results: Path, name: str, words: str) -> tuple[int, float] | None:
    """Return exit status and seconds of a finished study, None where it is not finished."""
    path = results / f'{name}.status'
    status, seconds, *kept = path.read_text().split() if path.exists() else ('2', '0')
    same = int(status) in _ENDED and (not kept or kept == words.split())
    return (int(status), float(seconds)) if same else None


def _tell(studies: Mapping[str, Any], done: Mapping[str, tuple[int, float] | None]) -> None:
    table = Table('study', 'hours', 'finished')
    for name, study in studies.items():
        status = done[name]
        ended = '' if status is None else f'{status[1] / 3600:.2f} h, status {status[0]}'
        table.add_row(name, f'{study["hours"]:g}', ended)
    left_h = sum(study['hours'] for name, study in studies.items() if done[name] is None)
    console = Console()
    console.print(table)
    console.print(f'left: about {left_h:g} h')


def _run(name: str, words: str, results: Path) -> tuple[int, float]:
    folder = results / name
    folder.mkdir(parents=True, exist_ok=True)
    bench = str(_ROOT / 'scripts' / 'bench.py')
    command = [sys.executable, bench, *(w.format(results=folder.resolve()) for w in words.split())]
    began_s = time.monotonic()
    with (results / f'{name}.log').open('a') as log:
        ended = subprocess.run(command, cwd=_ROOT, stdout=log, stderr=log, check=False)
    seconds = time.monotonic() - began_s
    if ended.returncode in _ENDED:
        (results / f'{name}.status').write_text(f'{ended.returncode} {seconds:.0f} {words}\n')
    return ended.returncode, seconds
