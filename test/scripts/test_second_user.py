"""A clone that one user made and another one starts: real users, which only root can become."""

from collections.abc import Iterator
import importlib.util
import os
from pathlib import Path
import shutil
import subprocess
import tempfile

import pytest

from small_clone import Clone

USER = 'nobody'
RECENT = 'import sys; sys.exit(sys.version_info < (3, 10))'

pytestmark = pytest.mark.skipif(os.getuid() != 0, reason='only root can become another user')


def run_as_other(*command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        user=USER,
        group='nogroup',
        extra_groups=[],
        cwd='/',
        env={'HOME': '/nonexistent', 'PATH': os.defpath, 'PYTHONDONTWRITEBYTECODE': '1'},
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
    )


def start(clone: Clone, python: str) -> tuple[int, str, str]:
    done = run_as_other(python, str(clone.root / 'scripts' / 'train.py'))
    return done.returncode, done.stdout, done.stderr


@pytest.fixture
def python() -> str:
    found = shutil.which('python3', path=os.defpath)
    if found is None or run_as_other(found, '-c', RECENT).returncode:
        pytest.skip('no Python 3.10 or newer that another user can start')
    return found


@pytest.fixture
def clone() -> Iterator[Clone]:
    """Give a clone that everybody can read; pytest's own folders are private."""
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        Path(folder).chmod(0o755)
        root = Path(folder, 'clone')
        root.mkdir(mode=0o755)
        yield Clone(root)


def test_a_clone_of_another_user_without_environment_is_read_only(
    clone: Clone, python: str
) -> None:
    line = f'goalreach: {clone.root}: cannot make .venv here, the folder is read-only\n'
    assert start(clone, python) == (1, '', line)
    assert not clone.venv.exists()


def test_an_environment_that_cannot_be_looked_into_is_named(clone: Clone, python: str) -> None:
    clone.venv.mkdir(mode=0o700)
    line = 'Permission denied: clone the repository as the user who runs it\n'
    assert start(clone, python) == (1, '', f'goalreach: {clone.venv}/goalreach-setup: {line}')


@pytest.mark.skipif(importlib.util.find_spec('ensurepip') is None, reason='needs ensurepip')
def test_an_environment_of_another_user_works_or_gets_one_line(clone: Clone, python: str) -> None:
    made = clone.run()
    assert made.status == 0, made.err
    link = clone.venv / 'bin' / 'python'
    private = clone.root / 'private'
    private.mkdir(mode=0o700)
    interpreter = link.resolve()
    (private / 'python').symlink_to(interpreter)

    link.unlink()
    link.symlink_to(private / 'python')
    line = 'Permission denied: clone the repository as the user who runs it\n'
    assert start(clone, python) == (1, '', f'goalreach: {link}: {line}')

    link.unlink()
    link.symlink_to(python)
    status, out, error = start(clone, python)
    assert (status, error) == (0, '')
    assert str(clone.venv) in out

    moved = clone.root.with_name('moved')
    clone.root.rename(moved)
    done = run_as_other(python, str(moved / 'scripts' / 'train.py'))
    line = f'goalreach: {moved}: cannot make .venv here, the folder is read-only\n'
    assert (done.returncode, done.stdout, done.stderr) == (1, '', line)
