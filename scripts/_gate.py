"""The gate: every check of the project, one after the other, with a summary at the end."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
import importlib.util
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time

import _colcon
from _environment import ROOT
from _install import say

TOOLS = ('ruff', 'mypy', 'pytest', 'pytest_timeout', 'hypothesis')


@dataclass(frozen=True, kw_only=True)
class Result:
    """What came out of one step.

    Attributes:
        name: Name of the step.
        ok: Whether it passed.
        seconds: How long it took.
        note: A few words about it, its reason where it failed.
    """

    name: str
    ok: bool
    seconds: float
    note: str


@dataclass(frozen=True, kw_only=True)
class Step:
    """One check.

    Attributes:
        name: Name of the step.
        check: Does it; returns whether it passed, and a note.
    """

    name: str
    check: Callable[[], tuple[bool, str]]

    def run(self) -> Result:
        """Do the check and measure its time."""
        print(f'== {self.name}', flush=True)
        started_s = time.monotonic()
        ok, note = self.check()
        return Result(name=self.name, ok=ok, seconds=time.monotonic() - started_s, note=note)


def main(arguments: list[str]) -> int:
    """Run all checks.

    Args:
        arguments: Of the command line.

    Returns:
        0 if all passed, else 1.
    """
    options = _parse(arguments)
    missing = [name for name in TOOLS if importlib.util.find_spec(name) is None]
    if missing:
        names = ' '.join(missing).replace('_', '-')
        say(f'this environment lacks {names}: install the extra `dev` (CONTRIBUTING.md).')
        return 1
    with tempfile.TemporaryDirectory(prefix='goalreach-') as scratch:
        results = [step.run() for step in _steps(options, Path(scratch))]
    return _summarize(results)


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='run_tests.py', description='Run ruff, mypy, pytest and colcon; all must pass.'
    )
    parser.add_argument(
        '--fast', action='store_true', help='leave out colcon and the tests that start processes'
    )
    parser.add_argument(
        'pytest', nargs='*', metavar='ARGUMENT', help='arguments for pytest, after `--`'
    )
    return parser.parse_args(arguments)


def _steps(options: argparse.Namespace, scratch: Path) -> list[Step]:
    chosen = ['-m', 'not graph'] if options.fast else []
    steps = [
        Step(name='ruff check', check=lambda: _command('ruff', 'check', '.')),
        Step(name='ruff format', check=lambda: _command('ruff', 'format', '--check', '.')),
        Step(name='mypy', check=lambda: _command('mypy', '--strict')),
        Step(name='pytest', check=lambda: _pytest([*chosen, *options.pytest])),
    ]
    colcon = _colcon.find()
    if options.fast:
        return steps
    if colcon is None:
        print('colcon is not installed here: its steps are left out', flush=True)
        return steps
    workspace = _colcon.Workspace(colcon=colcon, root=ROOT, scratch=scratch)
    return [
        *steps,
        Step(name='colcon list', check=workspace.list_packages),
        Step(name='colcon build', check=workspace.build),
        Step(name='colcon test', check=workspace.test),
    ]


def _command(*words: str) -> tuple[bool, str]:
    command = [sys.executable, '-m', *words]
    return subprocess.run(command, cwd=ROOT, check=False).returncode == 0, ''


def _pytest(arguments: list[str]) -> tuple[bool, str]:
    """Run pytest, show what it prints as it comes, and keep its closing line as the note."""
    colour = ['--color=yes'] if sys.stdout.isatty() else []
    command = [sys.executable, '-m', 'pytest', *colour, *arguments]
    environment = {**os.environ, 'PYTHONUNBUFFERED': '1'}
    last = ''
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment
    ) as child:
        for line in child.stdout or ():
            print(line, end='', flush=True)
            last = line.strip() or last
    return child.returncode == 0, last


def _summarize(results: list[Result]) -> int:
    """Print a line for each step, and pytest's closing line as the last."""
    failed = [result.name for result in results if not result.ok]
    print('== summary')
    for result in results:
        verdict = 'ok' if result.ok else 'FAILED'
        note = '' if result.name == 'pytest' else result.note
        print(f'{result.name:<13}{verdict:<7}{result.seconds:7.1f} s  {note}'.rstrip())
    print(f'failed: {", ".join(failed)}' if failed else 'all passed')
    for result in results:
        if result.name == 'pytest':
            print(result.note, flush=True)
    return 1 if failed else 0
