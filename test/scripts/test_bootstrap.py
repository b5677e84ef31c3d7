"""The set-up as a user meets it: real processes, real virtual environments, no network."""

from collections.abc import Callable
import importlib.util
from pathlib import Path
import re
import signal
import subprocess
import venv as stdlib_venv

import pytest

from _environment import DEPENDENCIES, ROOT
import _venv
from _venv import LOCKS, MARKER_NAME, SetupError, State, Venv, build_tools, own_base
from small_clone import Clone, finish, place_package

GATE = """
import importlib.util, json

def main(arguments):
    print(json.dumps({'found': importlib.util.find_spec('extra') is not None}))
    return 0
"""

needs_venv = pytest.mark.skipif(
    importlib.util.find_spec('ensurepip') is None, reason='this Python cannot make environments'
)


@needs_venv
def test_two_first_starts_at_once_make_one_environment(clone: Clone) -> None:
    first = clone.start('--trials', '3')
    second = clone.start(LD_LIBRARY_PATH='/a', _ROS_WHEELS_BOOTSTRAP_COMPLETE='1')
    outcomes = [finish(first), finish(second)]

    assert [outcome.status for outcome in outcomes] == [0, 0]
    assert outcomes[0].said['arguments'] == ['train', '--trials', '3']
    assert [outcome.said['prefix'] for outcome in outcomes] == [str(clone.venv)] * 2
    assert set(outcomes[1].said['variables'].values()) == {None}
    errors = outcomes[0].err + outcomes[1].err
    assert errors.count('setting up /') == 1
    assert errors.count('waiting for it') == 1
    assert errors.count('goalreach: locked packages\n') == 1

    again = clone.run('fail')
    assert (again.status, again.err) == (3, '')


@needs_venv
def test_lock_that_cannot_be_satisfied_leaves_nothing(clone: Clone) -> None:
    with clone.lock.open('a') as lock:
        lock.write('no-such-wheel==1.0 --hash=sha256:' + 64 * '0' + '\n')

    outcome = clone.run()

    assert (outcome.status, outcome.out) == (1, '')
    assert 'the set-up failed: locked packages' in outcome.err
    assert 'No matching distribution found for no-such-wheel' in outcome.err
    assert 'Start the same command again' in outcome.err
    assert not list(clone.root.glob('.venv*'))


@needs_venv
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_interrupted_set_up_leaves_nothing(
    clone: Clone, tmp_path: Path, number: signal.Signals
) -> None:
    temporary = tmp_path / 'temporary'
    temporary.mkdir()
    clone.venv.mkdir()
    (clone.venv / MARKER_NAME).touch()  # as after SIGKILL
    (clone.venv / 'leftover').touch()
    child = clone.start(TMPDIR=str(temporary))
    assert child.stderr is not None
    started = [child.stderr.readline(), child.stderr.readline()]
    assert 'virtual environment' in started[1]
    assert not (clone.venv / 'leftover').exists()

    child.send_signal(number)
    outcome = finish(child)

    assert (outcome.status, outcome.out) == (128 + number, '')
    assert f'interrupted by {number.name}' in outcome.err
    assert not list(clone.root.glob('.venv*'))
    assert not list(temporary.iterdir())


@needs_venv
@pytest.mark.parametrize('installer', ['uv', 'pip'])
def test_what_only_tests_need_is_added_later(clone: Clone, installer: str) -> None:
    if installer == 'uv':
        clone.lock_uv()
    support = clone.root / 'test' / 'support'
    support.mkdir(parents=True)
    (support / 'gate.py').write_text(GATE)
    whole = clone.lock.read_text() + clone.wheel('extra', 'extra.py')
    broken = whole + 'no-such-wheel==1.0 --hash=sha256:' + 64 * '0' + '\n'
    (clone.root / 'requirements-dev.lock').write_text(broken)

    first = clone.run()
    assert first.status == 0, first.err
    assert not list(clone.venv.glob('lib/*/site-packages/extra.py'))
    failed = clone.run(script='run_tests.py')
    assert failed.status == 1
    assert 'still serves the other commands' in failed.err
    again = clone.run()
    assert (again.status, again.err) == (0, '')

    (clone.root / 'requirements-dev.lock').write_text(whole)
    tests = clone.run(script='run_tests.py')
    assert tests.status == 0, tests.err
    assert tests.said['found'] is True
    assert tests.err.count('virtual environment') == 0
    again = clone.run()
    assert (again.status, again.err) == (0, '')
    assert not (clone.venv / 'tmp').exists()


def test_foreign_environment_is_left_alone(clone: Clone) -> None:
    clone.venv.mkdir()
    (clone.venv / 'precious').touch()

    outcome = clone.run()

    assert (outcome.status, outcome.out) == (1, '')
    assert re.fullmatch(r'goalreach: .* was not made by these scripts .*\n', outcome.err)
    assert (clone.venv / 'precious').exists()


def test_foreign_environment_with_goalreach_is_used(clone: Clone) -> None:
    stdlib_venv.create(clone.venv, symlinks=True)
    (site,) = clone.venv.glob('lib/python3*/site-packages')
    place_package(site / 'rclpy')
    (site / 'goalreach.pth').write_text(str(clone.root / 'src' / 'goalreach_bringup'))

    outcome = clone.run()

    assert (outcome.status, outcome.err) == (0, '')
    assert outcome.said['prefix'] == str(clone.venv)


def test_sourced_workspace_is_used_as_it_is(clone: Clone, tmp_path: Path) -> None:
    for name in ['rclpy', *(module.partition('.')[0] for module in DEPENDENCIES)]:
        place_package(tmp_path / 'opt' / name)
    place_package(tmp_path / 'opt' / 'rosbags' / 'rosbag2')

    outcome = clone.run(PYTHONPATH=str(tmp_path / 'opt'), ROS_DISTRO='jazzy')

    folder = str(clone.root / 'src' / 'goalreach_bringup')
    assert (outcome.status, outcome.err) == (0, '')
    assert outcome.said['first'] == folder
    assert outcome.said['variables']['PYTHONPATH'] == f'{folder}:{tmp_path / "opt"}'
    assert not clone.venv.exists()


def test_sourced_workspace_without_a_dependency_says_which(clone: Clone, tmp_path: Path) -> None:
    absent = ('rich', 'rosbags.rosbag2')
    for name in {'rclpy', *DEPENDENCIES}.difference(absent):
        place_package(tmp_path / 'opt' / name)

    outcome = clone.run(PYTHONPATH=str(tmp_path / 'opt'), ROS_DISTRO='jazzy')

    assert outcome.status == 1
    assert re.fullmatch(r'goalreach: .*lacks rich rosbags: .*\n', outcome.err)


def test_sourced_workspace_of_another_python_says_so(clone: Clone, tmp_path: Path) -> None:
    place_package(tmp_path / 'opt' / 'rclpy', 'raise ImportError')

    outcome = clone.run(PYTHONPATH=str(tmp_path / 'opt'), ROS_DISTRO='jazzy')

    assert outcome.status == 1
    assert re.fullmatch(r'goalreach: the rclpy on the path cannot be .*\n', outcome.err)


@needs_venv
def test_another_ros_gives_way_to_the_environment(clone: Clone, tmp_path: Path) -> None:
    place_package(tmp_path / 'imports' / 'rclpy')
    place_package(tmp_path / 'fails' / 'rclpy', 'raise ImportError')
    place_package(tmp_path / 'own' / 'mine')
    lines = []
    for ros in ('imports', 'fails'):
        folders = f'{tmp_path / ros}:{tmp_path / "own"}'
        for distribution in ({}, {'ROS_DISTRO': 'humble'}):
            outcome = clone.run(PYTHONPATH=folders, **distribution)

            assert outcome.status == 0
            assert re.search(r'goalreach: ROS_DISTRO = \w+: using \.venv instead of', outcome.err)
            assert outcome.said['variables']['PYTHONPATH'] == str(tmp_path / 'own')
            handed_over = outcome.said['variables']['GOALREACH_ROS2_HANDED_OVER']
            assert handed_over == '1', 'the ros2 of the other would not start'
            lines.append(outcome.err.count('\n'))
    assert lines[0] > 1, 'the first start sets up'
    assert lines[1:] == [1, 1, 1]


@pytest.mark.parametrize(
    ('patch', 'line'),
    [
        ('sys.version_info = (3, 9, 0)', r'goalreach needs Python 3.10 or newer, .*'),
        ("sys.platform = 'win32'", r'goalreach runs on Linux only: .* WSL .*'),
        (
            'os.access = lambda path, mode: mode != os.W_OK',  # as for users other than root
            r'goalreach: .*: cannot make .venv here, the folder is read-only',
        ),
        (
            'pathlib.Path.is_file = refuse',
            r'goalreach: x: Denied: clone the repository as .*',
        ),
    ],
    ids=['old Python', 'Windows', 'read-only', "somebody else's"],
)
def test_what_cannot_work_gets_one_line(clone: Clone, patch: str, line: str) -> None:
    if 'Denied' in line:
        clone.venv.mkdir()
    script = clone.root / 'scripts' / 'train.py'
    code = f"""
import os, pathlib, runpy, sys
def refuse(path):
    raise PermissionError(13, 'Denied', 'x')
{patch}
sys.path.insert(0, {str(script.parent)!r})
runpy.run_path({str(script)!r}, run_name='__main__')
"""
    done = subprocess.run([own_base(), '-c', code], capture_output=True, text=True, check=False)

    assert done.returncode == 1
    assert re.fullmatch(line + r'\n', done.stderr)


@pytest.mark.parametrize(
    ('prepare', 'state'),
    [
        (lambda _: None, State.ABSENT),
        (Path.mkdir, State.INCOMPLETE),
        (Path.touch, State.FOREIGN),
        (lambda path: path.symlink_to('nowhere'), State.FOREIGN),
    ],
)
def test_what_is_found_where_the_environment_belongs(
    tmp_path: Path, prepare: Callable[[Path], None], state: State
) -> None:
    prepare(tmp_path / '.venv')

    assert Venv(tmp_path).state() is state


def test_python_without_venv_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_venv, '_can_run', lambda _, code: 'ensurepip' not in code)

    with pytest.raises(SetupError, match='sudo apt install python3-venv'):
        _venv.base_python()


def test_machine_without_wheels_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('platform.machine', lambda: 'aarch64')

    with pytest.raises(SetupError, match='source a ROS 2 Jazzy workspace'):
        _venv.base_python()


def test_python_newer_than_the_wheels_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_venv, 'SUPPORTED_MINORS', (1,))

    with pytest.raises(SetupError, match='none of them was found'):
        _venv.base_python()


def test_uv_follows_the_settings_of_pip() -> None:
    settings = (
        "global.index-url='https://a/simple'\nglobal.cert='/old.pem'\nglobal.timeout='3'\n"
        "install.find-links='/b\\n/c'\n:env:.cert='/new.pem'\n"
    )

    assert _venv.uv_variables(settings) == {
        'UV_DEFAULT_INDEX': 'https://a/simple',
        'UV_FIND_LINKS': '/b,/c',
        'SSL_CERT_FILE': '/new.pem',
    }


@pytest.mark.parametrize('name', LOCKS.values())
def test_lock_has_hashes_and_no_addresses(name: str) -> None:
    text = (ROOT / name).read_text()
    entries = re.findall(r'^[a-z0-9].*(?:\n +.*)*', text, flags=re.MULTILINE)

    assert len(entries) > 100
    assert all(' --hash=sha256:' in entry for entry in entries)
    assert not re.search(r'://|@|--index|--find-links|^#', text, flags=re.MULTILINE)
    assert build_tools(text).count('==') == 3


def test_each_lock_holds_the_one_before() -> None:
    pins = [
        set(re.findall(r'^([a-z0-9._-]+)(?:\[.*\])?(==\S+)', text, re.MULTILINE))
        for text in ((ROOT / name).read_text() for name in LOCKS.values())
    ]

    assert pins[0] < pins[1] < pins[2]


def test_dependencies_are_those_of_the_distribution() -> None:
    text = (ROOT / 'pyproject.toml').read_text()
    (declared,) = re.findall(r'^dependencies = \[(.*?)^\]', text, flags=re.DOTALL | re.MULTILINE)
    names = {name for name in re.findall(r"'(.*)'", declared) if not name.startswith('ros-')}

    assert set(DEPENDENCIES.values()) == names


def test_every_script_names_a_command() -> None:
    commands = {
        path.name: re.findall(r"^    run\('([\w-]+)'\)$", path.read_text(), flags=re.MULTILINE)
        for path in (ROOT / 'scripts').glob('[a-z]*.py')
    }
    assert commands.pop('run_tests.py') == []
    assert commands.pop('bench.py') == []
    assert commands.pop('docs.py') == []
    assert commands.pop('run_stack.py') == ['run']
    assert commands == {f'{name.replace("-", "_")}.py': [name] for (name,) in commands.values()}
    assert len(commands) == 14
