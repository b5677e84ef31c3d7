"""The gate: every check of the project, one after the other, with a summary at the end."""

import argparse
from collections.abc import Callable
import importlib.util
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time

from _environment import ROOT
from _venv import say
from colcon_workspace import Workspace

TOOLS = ('ruff', 'mypy', 'pytest', 'pytest_timeout', 'xdist', 'hypothesis')
WORKERS = 2  # of pytest; a third one disturbs graphs in real time on two cores

Step = tuple[str, Callable[[], tuple[bool, str]]]


def main(arguments: list[str]) -> int:
    """Run all checks.

    Args:
        arguments: Of the command line.

    Returns:
        0 if all passed, else 1.
    """
    missing = [name for name in TOOLS if importlib.util.find_spec(name) is None]
    if missing:
        names = ' '.join(missing).replace('_', '-')
        say(f'this environment lacks {names}: install the extra `dev` (CONTRIBUTING.md).')
        return 1
    from goalreach_bringup.cli import guarded

    return guarded('run_tests.py', lambda: _run(_parse(arguments)))


def _run(options: argparse.Namespace) -> int:
    results: list[tuple[str, bool, float, str]] = []
    with tempfile.TemporaryDirectory(prefix='goalreach-') as scratch:
        for name, check in _steps(options, Path(scratch)):
            print(f'== {name}', flush=True)
            started_s = time.monotonic()
            ok, note = check()
            results.append((name, ok, time.monotonic() - started_s, note))
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
    """Return the steps; the tests that colcon runs are left out of pytest's."""
    colcon = None if options.fast or options.pytest else Workspace.find(ROOT, scratch)
    chosen = ['-m', 'not graph'] if options.fast else []
    if colcon:
        chosen = ['-m', 'graph or not package']
    steps: list[Step] = [
        ('ruff check', lambda: _command('ruff', 'check', '.')),
        ('ruff format', lambda: _command('ruff', 'format', '--check', '.')),
        ('mypy', lambda: _command('mypy', '--strict')),
        ('pytest', lambda: _pytest([*chosen, *options.pytest])),
    ]
    if colcon:
        names = ('colcon list', 'colcon build', 'colcon test')
        steps += zip(names, (colcon.list_packages, colcon.build, colcon.test), strict=True)
    elif not options.fast and not options.pytest:
        print('colcon is not installed here: its steps are left out', flush=True)
    return steps


def _command(*words: str) -> tuple[bool, str]:
    command = [sys.executable, '-m', *words]
    return subprocess.run(command, cwd=ROOT, check=False).returncode == 0, ''


def _pytest(arguments: list[str]) -> tuple[bool, str]:
    """Run pytest, print its output as it comes, and keep its closing line as the note."""
    colour = ['--color=yes'] if sys.stdout.isatty() else []
    workers = ['-n', str(WORKERS), '--dist', 'worksteal']
    command = [sys.executable, '-m', 'pytest', '-q', *workers, *colour, *arguments]
    environment = {**os.environ, 'PYTHONUNBUFFERED': '1'}
    last = ''
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment
    ) as child:
        for line in child.stdout or ():
            print(line, end='', flush=True)
            last = line.strip() or last
    return child.returncode == 0, last


def _summarize(results: list[tuple[str, bool, float, str]]) -> int:
    """Print a line for each step, and pytest's closing line as the last."""
    failed = [name for name, ok, _, _ in results if not ok]
    print('== summary')
    for name, ok, seconds, note in results:
        shown = '' if name == 'pytest' else note
        print(f'{name:<13}{"ok" if ok else "FAILED":<7}{seconds:7.1f} s  {shown}'.rstrip())
    print(f'failed: {", ".join(failed)}' if failed else 'all passed')
    print(next(note for name, _, _, note in results if name == 'pytest'), flush=True)
    return 1 if failed else 0
