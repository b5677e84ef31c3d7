"""The command line as a person meets it."""

from collections.abc import Callable
import contextlib
import dataclasses
import errno
import gc
from importlib.metadata import version
import os
from pathlib import Path
import subprocess
import sys

import pytest

from goalreach_bringup import cli
from goalreach_bringup.cli import COMMANDS, guarded, load_command, main
from goalreach_bringup.launch.graph import NodeDiedError
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError
from goalreach_msgs_py.options import CommandOptions


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
        (['run', '--paths', '-1'], '--paths = -1: must be a whole number in [0, 1e+06]'),
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
    assert errors.startswith(f'goalreach {arguments[0]}: ')
    assert said in errors
    assert len(errors.strip().splitlines()) == 1


@pytest.mark.parametrize('command', ['run', 'check-robot', 'calibrate', 'replay bag --recompute'])
def test_a_parameter_that_no_node_has_is_refused(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    words = 'landmark_localizer: {ros__parameters: {image_transprt: compressed}}'
    Path('robot.yaml').write_text(words)
    assert main([*command.split(), '--params-file', 'robot.yaml']) == 2
    refused = "landmark_localizer.image_transprt = 'compressed': must be a parameter of that node"
    assert capsys.readouterr().err == f'goalreach {command.split(maxsplit=1)[0]}: {refused}\n'


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


def options_of(command: str) -> list[type[CommandOptions]]:
    """Return the options of a command and of its sub-commands that our parser reads."""
    loaded = load_command(command)
    found = [one.options for one in (loaded, *loaded.subcommands.values())]
    return [options for options in found if issubclass(options, CommandOptions)]


@pytest.mark.parametrize('command', COMMANDS)
def test_options_are_values_and_a_flag_is_off_until_it_is_given(command: str) -> None:
    for options in options_of(command):
        for each in dataclasses.fields(options):
            assert each.kw_only, each.name
            assert each.default is not True, each.name
        given = {each.name: Path('a') for each in dataclasses.fields(options) if required(each)}
        made = options(**given)
        with pytest.raises(dataclasses.FrozenInstanceError):
            made.added = 1  # type: ignore[attr-defined]


def required(field: dataclasses.Field[object]) -> bool:
    return field.default is field.default_factory is dataclasses.MISSING


@pytest.mark.parametrize(
    ('words', 'least', 'most'),
    [
        ('evaluate --jobs', 1, None),
        ('sweep --results x --seeds', 1, None),
        ('sweep --results x --drives', 1, None),
        ('sweep --results x --limit', 1, None),
        ('sweep --results x --after', 0, None),
        ('sweep --results x --jobs', 1, None),
        ('check-robot --duration', 1.0, None),
        ('calibrate --side', 0.3, 10.0),
        ('dashboard --port', 0, 65535),
        ('dashboard --listener', 0, None),
        ('run --paths', 0, None),
        ('run --seed', 0, 2**31 - 1),
    ],
)
def test_a_number_is_accepted_within_its_bounds(
    words: str, least: float, most: float | None
) -> None:
    name, *arguments = words.split()
    command, option = load_command(name), arguments[-1]
    for value in (least, *([] if most is None else [most])):
        command.parse(name, [*arguments, str(value)])
    step = type(least)(1) if isinstance(least, int) else 0.01
    for value in (least - step, *([] if most is None else [most + step])):
        with pytest.raises(ConfigurationError, match=f'{option} = '):
            command.parse(name, [*arguments, str(value)])


@pytest.mark.parametrize(
    ('words', 'numbers'),
    [
        ('train', {'seed': 0, 'trials': 20}),
        ('evaluate', {'seed': 0, 'jobs': 1}),
        ('sweep --results x', {'seeds': 10, 'drives': 22, 'limit': 440, 'after': 22, 'jobs': 1}),
        ('check-robot', {'duration': 5.0}),
        ('calibrate', {'side': 1.0}),
        ('run', {'seed': 0, 'paths': 0}),
    ],
)
def test_numbers_that_are_not_given_have_their_defaults(
    words: str, numbers: dict[str, float]
) -> None:
    name, *arguments = words.split()
    _, options = load_command(name).parse(name, arguments)
    assert {each: getattr(options, each) for each in numbers} == numbers


def test_the_version_is_that_of_the_distribution(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(['--version'])
    assert caught.value.code == 0
    assert capsys.readouterr().out == f'goalreach {version("goalreach")}\n'


@pytest.mark.parametrize('words', [[], ['fly'], ['--fly']])
def test_what_is_no_command_is_refused(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(words)
    assert caught.value.code == 2
    assert capsys.readouterr().err.startswith('usage: goalreach [-h]')


def named(name: str, text: str) -> Exception:
    """Return an error as rclpy raises it; its classes are compared by name."""
    kind: type[Exception] = type(name, (RuntimeError,), {})
    return kind(text)


def raising(error: BaseException, cause: BaseException | None = None) -> Callable[[], int]:
    def execute() -> int:
        try:
            if cause is not None:
                raise cause
        finally:
            raise error

    return execute


@pytest.mark.parametrize(
    ('execute', 'status', 'line'),
    [
        (lambda: 7, 7, ''),
        (raising(KeyboardInterrupt()), 130, ''),
        (raising(BrokenPipeError()), 141, ''),
        (raising(SystemExit(1), BrokenPipeError()), 141, ''),
        (raising(GoalreachError('no room')), 2, 'x: no room\n'),
        (raising(NodeDiedError('gone')), 1, 'x: gone\n'),
        (
            raising(named('RCLError', 'failed to initialize x\nmore')),
            2,
            'x: failed to initialize x\n',
        ),
        (raising(named('RCLInvalidROSArgsError', 'a word, at /b:3\nmore')), 2, 'x: a word\n'),
        (raising(OSError(errno.ENOSPC, 'full')), 1, 'x: the output cannot be written: full\n'),
    ],
)
def test_an_end_has_its_status_and_at_most_a_line(
    execute: Callable[[], int], status: int, line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert guarded('x', execute) == status
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ('', line)


@pytest.mark.parametrize(
    'error',
    [
        RuntimeError('error creating node'),
        OSError('error creating node'),
        named('RCLError', 'another'),
        SystemExit(3),
        OSError(errno.ENOSPC, 'full', 'a.json'),
        OSError(errno.ENOENT, 'none'),
    ],
    ids=str,
)
def test_an_error_in_the_program_is_not_hidden(error: BaseException) -> None:
    with pytest.raises(type(error)) as caught:
        guarded('x', raising(error))
    assert caught.value is error


@pytest.mark.parametrize(
    ('columns', 'kept'),
    [('80', True), ('99999', True), ('0', False), ('100000', False), ('-1', False), ('x', False)],
)
def test_a_width_that_is_none_is_not_used(
    columns: str, kept: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('COLUMNS', columns)
    assert guarded('x', lambda: 0) == 0
    assert ('COLUMNS' in os.environ) is kept


@pytest.mark.parametrize(
    ('words', 'forks'),
    [
        (['run', '--paths', '-1'], True),
        (['run', '--help'], False),
        (['run', '--paths', '-1', '-h'], False),
        (['evaluate', '--jobs', '0'], False),
        (['replay', '--rate', '0', 'bag'], False),
        (['train', '--trials', '0'], False),
    ],
)
def test_only_a_run_starts_the_server_of_its_nodes(
    words: list[str], forks: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[str] = []
    monkeypatch.setattr(cli, 'start_fork_server', lambda: started.append('server'))
    try:
        with contextlib.suppress(SystemExit):
            assert main(words) == 2
        assert started == ['server'] * bool(forks)
        assert gc.isenabled() != forks
    finally:
        gc.enable()
