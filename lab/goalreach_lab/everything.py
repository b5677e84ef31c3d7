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
_BENCH: Final = Path(__file__).parents[2] / 'scripts' / 'bench.py'


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
    of results then holds its exit status and its seconds.

    Raises:
        GoalreachError: A study missed a goal or failed; all others were run first.
        ConfigurationError: A study does not exist, or results are there and not to be resumed.
    """
    studies = _chosen(options.study)
    done = {name: _status(options.results, name) for name in studies}
    if any(done.values()) and not (options.resume or options.as_it_is):
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


def _status(results: Path, name: str) -> tuple[int, float] | None:
    """Return exit status and seconds of a finished study, None where it is not finished."""
    path = results / f'{name}.status'
    if not path.exists():
        return None
    status, seconds = path.read_text().split()
    return int(status), float(seconds)


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
    command = [sys.executable, str(_BENCH), *words.format(results=folder).split()]
    began_s = time.monotonic()
    with (results / f'{name}.log').open('a') as log:
        status = subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, check=False)
    seconds = time.monotonic() - began_s
    (results / f'{name}.status').write_text(f'{status.returncode} {seconds:.0f}\n')
    return status.returncode, seconds
