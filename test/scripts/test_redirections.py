"""Standard streams of the scripts that are closed, full, or whose reader goes away; Ctrl-C."""

import os
import signal
import subprocess
import sys

import pytest

from _environment import ROOT
from small_clone import Clone

FULL = 'the output cannot be written: No space left on device'


def redirected(script: str, redirection: str) -> subprocess.CompletedProcess[str]:
    shell = (
        f'set -o pipefail; "{sys.executable}" "{ROOT / "scripts" / script}" --help {redirection}'
    )
    environment = {name: v for name, v in os.environ.items() if name != 'PYTHONUNBUFFERED'}
    return subprocess.run(
        ['bash', '-c', shell], env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize('script', ['bench.py', 'run_tests.py', 'train.py'])
@pytest.mark.parametrize('redirection', ['>&-', '>/dev/full', '<&-', '2>&-', '| head -1'])
def test_a_script_bears_any_redirection(script: str, redirection: str) -> None:
    done = redirected(script, redirection)

    full = redirection == '>/dev/full'
    assert done.returncode in ((1,) if full else (0, 141) if '|' in redirection else (0,))
    assert FULL in done.stderr if full else not done.stderr
    assert done.stderr.count('\n') == full


@pytest.mark.parametrize('redirection', ['>&- 2>&-', '<&- >&-', '2>&-'])
def test_the_set_up_bears_any_redirection(clone: Clone, redirection: str) -> None:
    outcome = clone.run(redirection=redirection)

    assert outcome.status == 0, outcome.err
    assert clone.venv.is_dir()
    assert bool(outcome.said) is (redirection == '2>&-')


def test_ctrl_c_in_the_tests_gives_no_traceback() -> None:
    with subprocess.Popen(
        # Where the tests run in the background of a shell, children would ignore Ctrl-C.
        ['env', '--default-signal=INT', sys.executable, 'scripts/run_tests.py', '--fast'],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,  # a terminal sends Ctrl-C to the whole group
    ) as gate:
        assert gate.stdout is not None
        assert gate.stdout.readline() == '== ruff check\n'
        os.killpg(gate.pid, signal.SIGINT)
        out, error = gate.communicate(timeout=60.0)

    assert gate.returncode == 130
    assert 'Traceback' not in out + error
    assert '== summary' not in out
