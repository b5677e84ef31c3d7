"""Installing as people do, from the package index, then driving from another folder.

Too heavy for the gate (550 MB for each environment), so run by hand, with the Pythons to try:

    GOALREACH_PYTHONS=/usr/bin/python3.10:/usr/bin/python3.13 \
        python3 scripts/run_tests.py -- test/scripts/test_install.py
"""

from collections.abc import Callable
import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

from _venv import LOCKS, SIZES
import graphs

ROOT = Path(__file__).resolve().parents[2]
PYTHONS = [path for path in os.environ.get('GOALREACH_PYTHONS', '').split(os.pathsep) if path]
OLD_PIP = 'pip==23.2.1'
UV = (sys.executable, '-m', 'uv')
Way = Callable[[str, Path, Path], Path]

pytestmark = [pytest.mark.timeout(3600), pytest.mark.graph]


def call(*words: object, **variables: object) -> str:
    foreign = ('PYTHONPATH', 'VIRTUAL_ENV', '_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'LD_LIBRARY_PATH')
    inherited = {name: value for name, value in os.environ.items() if name not in foreign}
    done = subprocess.run(
        list(map(str, words)),
        env={**inherited, **{name: str(value) for name, value in variables.items()}},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def environment(python: str, folder: Path) -> Path:
    """Make an environment; return its Python."""
    call(python, '-m', 'venv', folder / 'environment')
    return folder / 'environment' / 'bin' / 'python'


def by_pip(python: str, source: Path, folder: Path) -> Path:
    inside = environment(python, folder)
    call(inside, '-m', 'pip', 'install', source)
    return inside.with_name('goalreach')


def by_old_pip_from_the_lock(python: str, source: Path, folder: Path) -> Path:
    inside = environment(python, folder)
    call(inside, '-m', 'pip', 'install', OLD_PIP)
    # One dependency is built from its source: its tools come first, from the same lock.
    lock = source / 'requirements.lock'
    call(inside, '-m', 'pip', 'install', '--require-hashes', '-r', lock)
    call(inside, '-m', 'pip', 'install', '--no-deps', source)
    return inside.with_name('goalreach')


def from_a_wheel(python: str, source: Path, folder: Path) -> Path:
    return _built('--wheel', '*.whl', python, source, folder)


def from_an_sdist(python: str, source: Path, folder: Path) -> Path:
    return _built('--sdist', '*.tar.gz', python, source, folder)


def _built(kind: str, pattern: str, python: str, source: Path, folder: Path) -> Path:
    call(*UV, 'build', kind, '-o', folder / 'dist', source)
    (built,) = (folder / 'dist').glob(pattern)
    inside = environment(python, folder)
    call(*UV, 'pip', 'install', '--python', inside, built)
    return inside.with_name('goalreach')


def by_uv_tool(python: str, source: Path, folder: Path) -> Path:
    command = folder / 'bin' / 'goalreach'
    places = {'UV_TOOL_DIR': folder / 'tools', 'UV_TOOL_BIN_DIR': command.parent}
    call(*UV, 'tool', 'install', '--python', python, source, **places)
    return command


def by_pipx(python: str, source: Path, folder: Path) -> Path:
    command = folder / 'bin' / 'goalreach'
    places = {'PIPX_HOME': folder / 'pipx', 'PIPX_BIN_DIR': command.parent}
    call(*UV, 'tool', 'run', 'pipx', 'install', '--python', python, source, **places)
    return command


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """Return a copy of the repository, as building leaves files there."""
    copy = tmp_path / 'my goalreach'
    shutil.copytree(ROOT / 'src', copy / 'src', ignore=shutil.ignore_patterns('*.egg-info'))
    for name in ('pyproject.toml', 'README.md', 'LICENSE', 'requirements.lock'):
        shutil.copy(ROOT / name, copy)
    return copy


@pytest.mark.parametrize('python', PYTHONS)
@pytest.mark.parametrize(
    'way',
    [from_a_wheel, from_an_sdist, by_uv_tool, by_pipx, by_pip, by_old_pip_from_the_lock],
)
def test_it_drives_as_installed(way: Way, python: str, source: Path, tmp_path: Path) -> None:
    command = way(python, source, tmp_path)
    home = tmp_path / 'home'
    home.mkdir()
    variables = (f'HOME={home}', 'PATH=/usr/bin:/bin', f'ROS_DOMAIN_ID={graphs.fresh_domain()}')
    run = ('env', '-i', '-C', home, *variables, command)

    assert call(*run, '--version').startswith('goalreach ')
    found = call(*run, 'doctor')
    assert 'wrong' not in found
    assert 'pip install' in found.partition('warn   live page')[2]
    for more in ((), ('--policy', 'paper')):
        out = call(*run, 'run', '--paths', '1', '--clock', 'lockstep', *more)
        assert '1 of 1 paths reached the goal' in out
    assert [path.name for path in home.iterdir()] == ['.ros']


@pytest.mark.parametrize('python', PYTHONS)
@pytest.mark.parametrize('group', LOCKS)
def test_a_lock_is_complete_and_takes_the_size_that_is_told(
    group: str, python: str, tmp_path: Path
) -> None:
    """With hashes required, uv refuses a dependency that the lock does not name."""
    inside = environment(python, tmp_path)
    call(*UV, 'pip', 'install', '--python', inside, '--require-hashes', '-r', ROOT / LOCKS[group])

    size_mb = 1.024e-3 * int(call('du', '-sk', tmp_path).split()[0])
    number, unit = SIZES[group].split()
    assert size_mb == pytest.approx(float(number) * (1000.0 if unit == 'GB' else 1.0), rel=0.15)
