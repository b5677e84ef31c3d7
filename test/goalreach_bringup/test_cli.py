"""The command line as a person meets it."""

import os
from pathlib import Path
import subprocess
import sys

import pytest

from goalreach_bringup.cli import COMMANDS, main


@pytest.mark.parametrize('command', COMMANDS)
def test_every_command_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([command, '--help'])
    assert caught.value.code == 0
    assert 'usage' in capsys.readouterr().out.lower()


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(['--help'])
    output = capsys.readouterr().out
    assert all(f'  {command} ' in output for command in COMMANDS)


@pytest.mark.parametrize(
    ('arguments', 'said'),
    [
        (['run', '--paths', '-1'], '--paths = -1: must be a whole number >= 0'),
        (['run', '--seed', '-1'], '--seed = -1'),
        (['run', '--start', 'here'], "--start = 'here'"),
        (['run', '--seed', '0', '--policy', 'missing.json'], 'missing.json: cannot be read'),
        (['run', '--learn', '--policy', 'paper'], "--policy = 'paper': must be a file to learn"),
        (['run', '--params-file', 'missing.yaml'], 'missing.yaml: cannot be read'),
        (['run', '--summary', '/missing/out.json'], '/missing/out.json: cannot be written'),
        (['evaluate', '--json', '/missing/out.json'], '/missing/out.json: cannot be written'),
        (['evaluate', '--starts', 'random:0'], "starts = 'random:0'"),
        (['evaluate', '--noise', 'loud'], 'loud: is no preset'),
        (['evaluate', '--jobs', '0'], '--jobs = 0'),
        (['evaluate', '--jobs', '1', '--policy', 'missing.json'], 'missing.json: cannot be read'),
    ],
)
def test_a_mistake_is_one_line_and_a_status(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    errors = capsys.readouterr().err
    assert said in errors
    assert len(errors.strip().splitlines()) == 1


@pytest.mark.parametrize('unbuffered', ['', '1'])
def test_a_reader_that_goes_away_is_no_error(unbuffered: str, tmp_path: Path) -> None:
    command = [sys.executable, '-m', 'goalreach_bringup.cli', 'train']
    train = subprocess.Popen(
        [*command, '--out', str(tmp_path / 'policy.json')],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, 'PYTHONUNBUFFERED': unbuffered},
    )
    assert train.stdout is not None
    assert train.stderr is not None
    train.stdout.close()
    assert train.stderr.read() == ''
    train.wait(30.0)
