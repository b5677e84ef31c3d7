from pathlib import Path
import sys
from unittest.mock import Mock
import webbrowser

import pytest

from goalreach_bringup.cli import main
from goalreach_bringup.commands import doctor
from goalreach_bringup.launch import auxiliary_processes
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.distribution import installed


def test_each_finding_has_a_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', '218')

    assert main(['doctor']) == 0
    lines = capsys.readouterr().out.splitlines()
    assert not any(line.startswith('wrong') for line in lines)
    assert [line[7:22].strip() for line in lines] == list(doctor._FINDINGS)
    assert any('rmw_fastrtps_cpp' in line for line in lines)
    assert any('218, UDP ports 61900 to 62149, 0 participants' in line for line in lines)


@pytest.mark.parametrize(
    ('name', 'value', 'wrong'),
    [
        ('ROS_DOMAIN_ID', 'abc', ['variables', 'domain']),
        ('RMW_IMPLEMENTATION', 'rmw_none_cpp', ['variables']),
        ('ROS_LOG_DIR', '/dev/null/logs', ['variables']),
        ('ROS_DISCOVERY_SERVER', '127.0.0.1:11811', ['variables']),
    ],
)
def test_what_is_wrong_is_named_and_sets_the_status(
    name: str,
    value: str,
    wrong: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', '218')
    monkeypatch.setenv(name, value)

    assert main(['doctor']) == 1
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith('wrong')]
    assert [line.split()[1] for line in lines] == wrong
    assert all(f"{name} = '{value}': must be " in line for line in lines)


def test_ros_that_cannot_be_imported_or_is_of_a_distribution_is_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, '_FINDINGS', {'ROS 2': doctor._ros})
    monkeypatch.setenv('ROS_DISTRO', 'rolling')
    for wheels, distribution in ((None, 'rolling'), (Mock(), f'{installed().name}, from wheels')):
        monkeypatch.setattr(doctor, 'find_spec', lambda _, found=wheels: found)
        assert main(['doctor']) == 0
        line = f'ok     ROS 2          {distribution}, rclpy in '
        assert capsys.readouterr().out.startswith(line)
    monkeypatch.setattr(doctor, '_ROS_PROBE', 'import rclpy_of_nobody')
    assert main(['doctor']) == 1
    reason = "ModuleNotFoundError: No module named 'rclpy_of_nobody'; reinstall goalreach\n"
    assert capsys.readouterr().out.endswith(f'rclpy cannot be imported: {reason}')


def test_without_the_web_library_a_run_is_possible(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(auxiliary_processes, 'find_spec', lambda name: name != 'starlette' or None)
    monkeypatch.setenv('ROS_DOMAIN_ID', '218')
    monkeypatch.delenv('_ROS_WHEELS_BOOTSTRAP_COMPLETE', raising=False)  # of the true prefix
    (tmp_path / 'scripts').mkdir()
    cures = []
    for prefix in (tmp_path / '.venv', tmp_path / 'elsewhere' / 'environment'):
        monkeypatch.setattr(sys, 'prefix', str(prefix))
        (tmp_path / 'scripts' / 'dashboard.py').touch()
        assert main(['doctor']) == 0
        (line,) = (x for x in capsys.readouterr().out.splitlines() if 'starlette' in x)
        assert line.startswith('warn   live page')
        with pytest.raises(GoalreachError, match=line[22:]):
            auxiliary_processes.is_page_wanted(requested=True, clock='realtime')
        assert main(['dashboard']) == 2
        assert line[22:] in capsys.readouterr().err
        cures.append(line.split('`')[1])

    assert cures == [
        f'python3 {tmp_path}/scripts/dashboard.py',
        f'{sys.executable} -m pip install starlette',
    ]


def test_what_a_container_lacks_has_its_cure(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(doctor, 'SHARED_MEMORY', tmp_path / 'none')
    monkeypatch.setattr(webbrowser, 'get', Mock(side_effect=webbrowser.Error))

    assert main(['doctor']) == 1
    out = capsys.readouterr().out
    assert 'wrong  shared memory  0 MB free, at least 64 MB are needed: ' in out
    assert '--shm-size=256m' in out
    assert 'warn   browser        none found: ' in out
