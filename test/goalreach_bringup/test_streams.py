"""Standard streams that are closed, full, or whose reader goes away, for real commands."""

from pathlib import Path
import subprocess
import sys

import pytest

import graphs

REDIRECTIONS = {'>&-': 0, '>/dev/full': 1, '<&-': 0, '2>&-': 0, '>&- 2>&-': 0, '| head -1': 141}
COMMANDS = {
    'doctor': 'doctor',
    'train': 'train --out policy.json',
    'evaluate': 'evaluate --starts random:1',
    'ros2': 'ros2 topic list --spin-time 1',
    'help': '--help',
}


def redirected(words: str, redirection: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command of goalreach in a real shell; the status of a pipe is that of the command."""
    shell = f'set -o pipefail; "{sys.executable}" -m goalreach_bringup.cli {words} {redirection}'
    environment = graphs.graph_environment(graphs.fresh_domain(), folder)
    environment.pop('PYTHONUNBUFFERED', None)
    return subprocess.run(
        ['bash', '-c', shell],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=100.0,
        check=False,
    )


def check(done: subprocess.CompletedProcess[str], redirection: str) -> None:
    allowed = {REDIRECTIONS[redirection]}
    if '|' in redirection:
        allowed.add(0)  # it had written everything before the reader went
    assert done.returncode in allowed, done.stderr
    # A slow machine may stall, which a run tells.
    errors = [line for line in done.stderr.splitlines() if 'stalled for' not in line]
    if redirection == '>/dev/full':
        assert len(errors) == 1
        assert errors[0].endswith('the output cannot be written: No space left on device')
    else:
        assert errors == []
    assert len(done.stdout.splitlines()) <= 1 or redirection in ('<&-', '2>&-')


@pytest.mark.parametrize('redirection', REDIRECTIONS)
@pytest.mark.parametrize('command', COMMANDS.values(), ids=COMMANDS)
def test_a_command_bears_any_redirection(command: str, redirection: str, tmp_path: Path) -> None:
    check(redirected(command, redirection, tmp_path), redirection)


@pytest.mark.graph
@pytest.mark.parametrize('redirection', REDIRECTIONS)
def test_a_run_bears_any_redirection(redirection: str, tmp_path: Path) -> None:
    words = 'run --paths 1 --start 1.8,2.2,-90 --policy paper --clock lockstep'
    check(redirected(words, redirection, tmp_path), redirection)


@pytest.fixture(scope='module')
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('recorded')
    words = 'run --paths 1 --start 1.8,2.2,-90 --policy paper --clock lockstep --record bag'
    done = redirected(words, '', folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.graph
@pytest.mark.parametrize('redirection', REDIRECTIONS)
def test_a_bag_bears_any_redirection(redirection: str, recorded: Path) -> None:
    check(redirected('bag info bag', redirection, recorded), redirection)
