"""Completion in a real bash, through the function that argcomplete registers there."""

import os
from pathlib import Path
import subprocess
import sys

import pytest

from goalreach_bringup.cli import COMMANDS

SCRIPT = """
eval "$(register-python-argcomplete goalreach)"
COMP_LINE=$1 COMP_POINT=${#1} COMP_TYPE=9 COMP_KEY=9
_python_argcomplete goalreach
((${#COMPREPLY[@]})) && printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a command `goalreach` and some files."""
    path = tmp_path_factory.mktemp('completion')
    command = path / 'bin' / 'goalreach'
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m goalreach_bringup.cli "$@"\n')
    command.chmod(0o755)
    (path / 'panorama.json').touch()
    (path / 'my bag').mkdir()
    return path


def completed(line: str, folder: Path) -> list[str]:
    paths = [str(folder / 'bin'), str(Path(sys.executable).parent), os.environ['PATH']]
    done = subprocess.run(
        ['bash', '--norc', '-c', SCRIPT, 'bash', line],
        cwd=folder,
        env={**os.environ, 'PATH': os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
    )
    assert done.stderr == ''
    return done.stdout.splitlines()


@pytest.mark.parametrize(
    ('line', 'expected'),
    [
        ('goalreach trai', ['train ']),
        ('goalreach run --learn', ['--learn', '--learner']),
        ('goalreach run --clock ', ['lockstep', 'realtime']),
        ('goalreach run --clock=lo', ['lockstep ']),
        ('goalreach run --paths ', []),
        ('goalreach run --policy pa', ['panorama.json', 'paper']),
        ('goalreach run --clock lockstep --arena narr', ['narrow ']),
        ('goalreach run --summary pan', ['panorama.json ']),
        ('goalreach bag comp', ['compare ']),
        ('goalreach bag info m', [r'my\ bag/']),
        ('goalreach ros2 top', ['topic ']),
        ('goalreach ros2 topic ec', ['echo ']),
        ('goalreach ros2 topic echo /cmd', ['/cmd_vel ']),
        ('goalreach ros2 param get /state', ['/state_estimator ']),
        ('goalreach --vers', ['--version ']),
    ],
)
def test_bash_completes_the_line(line: str, expected: list[str], folder: Path) -> None:
    assert sorted(completed(line, folder)) == sorted(expected)


def test_bash_lists_the_commands(folder: Path) -> None:
    assert {*COMMANDS, '--help'} <= set(completed('goalreach ', folder))
