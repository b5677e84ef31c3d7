"""The gate: every check of the project, with a summary at the end.

Tests of graphs wait as often as they compute. What needs no graph runs in the pauses: in a process
of low priority beside pytest, which prints when pytest has finished.
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import importlib.util
import multiprocessing
from multiprocessing.connection import Connection
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import tempfile
import time

from _environment import ROOT
from _venv import say
from colcon_workspace import Workspace

TOOLS = ('ruff', 'mypy', 'pytest', 'pytest_timeout', 'xdist', 'hypothesis', 'slipcover')
WORKERS = 3  # of pytest: tests of graphs wait as often as they compute
MOST_AGAIN = 5  # failed tests, which those beside them may have slowed; more are no chance
LOW_PRIORITY = 10  # of the steps beside pytest, as `nice` counts: a tenth of a core's time at most

Step = tuple[str, Callable[[], tuple[bool, str]]]
Result = tuple[str, bool, float, str]


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
    with tempfile.TemporaryDirectory(prefix='goalreach-') as scratch:
        steps, beside = _steps(options, Path(scratch))
        with _started_beside(beside, Path(scratch, 'beside.txt')) as finish:
            results = [_execute(step) for step in steps]
            results += finish()
    return _summarize(results)


def _execute(step: Step) -> Result:
    name, check = step
    print(f'== {name}', flush=True)
    started_s = time.monotonic()
    ok, note = check()
    return name, ok, time.monotonic() - started_s, note


@contextmanager
def _started_beside(steps: list[Step], log: Path) -> Iterator[Callable[[], list[Result]]]:
    """Start steps in a group of processes, which ends with the block.

    Yields:
        A function that awaits them and prints their output.
    """
    receiver, sender = multiprocessing.Pipe(duplex=False)
    context = multiprocessing.get_context('fork')
    child = context.Process(target=_execute_beside, args=(steps, log, sender))
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # until it is in its own group
    child.start()
    sender.close()
    assert child.pid is not None
    group = child.pid
    os.setpgid(group, group)

    def finish() -> list[Result]:
        try:
            results: list[Result] = receiver.recv()
        except EOFError:
            results = [(name, False, 0.0, 'did not finish') for name, _ in steps]
        child.join()
        print(log.read_text(errors='replace'), end='', flush=True)
        return results

    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        yield finish
    finally:
        if child.is_alive():
            os.killpg(group, signal.SIGTERM)
        child.join()


def _execute_beside(steps: list[Step], log: Path, sender: Connection) -> None:
    """Execute steps, their output in a file."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    os.nice(LOW_PRIORITY)
    with log.open('w') as stream, Path(os.devnull).open() as nothing:
        for number, target in enumerate((nothing, stream, stream)):
            os.dup2(target.fileno(), number)
        sender.send([_execute(step) for step in steps])


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='run_tests.py', description='Run ruff, mypy, pytest and colcon; all must pass.'
    )
    parser.add_argument(
        '--fast',
        action='store_true',
        help='leave out colcon and the tests of graphs and set-ups',
    )
    parser.add_argument(
        'pytest', nargs='*', metavar='ARGUMENT', help='arguments for pytest, after `--`'
    )
    return parser.parse_args(arguments)


def _steps(options: argparse.Namespace, scratch: Path) -> tuple[list[Step], list[Step]]:
    """Return the steps and those beside them; pytest leaves out the tests that colcon runs."""
    colcon = None if options.fast or options.pytest else Workspace.find(ROOT, scratch)
    chosen = ['-m', 'not graph and not slow'] if options.fast else []
    if colcon:
        chosen = ['-m', 'graph or not package']
    steps: list[Step] = [
        ('ruff check', lambda: _command('ruff', 'check', '.')),
        ('ruff format', lambda: _command('ruff', 'format', '--check', '.')),
        ('pytest', lambda: _pytest([*chosen, *options.pytest])),
    ]
    beside: list[Step] = [('mypy', lambda: _command('mypy', '--strict'))]
    if colcon:
        beside += [
            ('colcon list', colcon.list_packages),
            ('colcon build', colcon.build),
            ('colcon test', colcon.test),
            ('coverage', colcon.measure_coverage),
        ]
    elif not options.fast and not options.pytest:
        print('colcon is not installed here: its steps are left out', flush=True)
    return steps, beside


def _command(*words: str) -> tuple[bool, str]:
    # Not by Python: it prints a traceback where Ctrl-C comes while it starts.
    program = Path(sys.executable).with_name(words[0])
    command = [str(program)] if program.is_file() else [sys.executable, '-m', words[0]]
    return subprocess.run([*command, *words[1:]], cwd=ROOT, check=False).returncode == 0, ''


def _pytest(arguments: list[str]) -> tuple[bool, str]:
    """Run the tests, and once more, alone, the few that failed beside others."""
    ok, last, names = _run_pytest(['-n', str(WORKERS), '--dist', 'worksteal', *arguments])
    failed = sum(map(int, re.findall(r'(\d+) (?:failed|error)', last)))
    if 0 < failed <= MOST_AGAIN:
        print('== pytest, what failed once more, alone')
        ok, alone, again = _run_pytest(['--last-failed', *arguments])
        last = f'{last}; alone: {alone}'
        if only := [name for name in names if name not in again]:
            last += f'; passed only alone: {", ".join(only)}'
    return ok, last


def _run_pytest(arguments: list[str]) -> tuple[bool, str, list[str]]:
    """Run pytest and print its output as it comes; return its closing line and what failed."""
    colour = ['--color=yes'] if sys.stdout.isatty() else []
    command = [sys.executable, '-m', 'pytest', '-q', *colour, *arguments]
    environment = {**os.environ, 'PYTHONUNBUFFERED': '1'}
    last, failed = '', []
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment
    ) as child:
        for line in child.stdout or ():
            print(line, end='', flush=True)
            last = line.strip() or last
            plain = re.sub(r'\x1b\[[\d;]*m', '', line)
            failed += re.findall(r'^(?:FAILED|ERROR) (\S+?::.+?)(?: - .*)?$', plain)
    return child.returncode == 0, last, failed


def _summarize(results: list[Result]) -> int:
    """Print a line for each step, and pytest's closing line as the last."""
    failed = [name for name, ok, _, _ in results if not ok]
    print('== summary')
    for name, ok, seconds, note in results:
        shown = '' if name == 'pytest' else note
        print(f'{name:<13}{"ok" if ok else "FAILED":<7}{seconds:7.1f} s  {shown}'.rstrip())
    print(f'failed: {", ".join(failed)}' if failed else 'all passed')
    print(next(note for name, _, _, note in results if name == 'pytest'), flush=True)
    return 1 if failed else 0
