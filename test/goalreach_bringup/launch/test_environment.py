"""Who can reach a graph is decided by one profile."""

import os
from pathlib import Path
import xml.etree.ElementTree as ET

import pytest

from goalreach_bringup.launch.environment import graph_environment, make_run_directory
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, open_to_network, use_profile

ADDRESS = './/{*}interfaceWhiteList/{*}address'
VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
NEWER = 'FASTDDS_DEFAULT_PROFILES_FILE'


def test_a_graph_is_private_to_its_machine_unless_it_is_asked_to_be_open() -> None:
    private = ET.parse(fast_dds_profile()).findall(ADDRESS)  # noqa: S314 - our own file
    assert [address.text for address in private] == ['127.0.0.1']
    assert not ET.parse(fast_dds_profile(network=True)).findall(ADDRESS)  # noqa: S314


def test_opening_says_what_it_exposes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(VARIABLE, 'of-somebody')
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    line = open_to_network()
    assert 'drive the robot' in line
    assert 'ROS_DOMAIN_ID 7' in line
    assert graph_environment(os.environ, tmp_path)[VARIABLE] == fast_dds_profile(network=True)


@pytest.mark.parametrize(
    ('given', 'used'),
    [
        ({}, fast_dds_profile()),
        ({VARIABLE: ''}, fast_dds_profile()),
        ({VARIABLE: 'mine'}, 'mine'),
        ({VARIABLE: '', NEWER: 'newer'}, 'newer'),
        ({VARIABLE: 'mine', NEWER: 'newer'}, 'mine'),
    ],
)
def test_a_profile_of_the_user_is_kept(
    given: dict[str, str], used: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert graph_environment(given, tmp_path)[VARIABLE] == used
    for name in (VARIABLE, NEWER):
        monkeypatch.setenv(name, given.get(name, ''))
    use_profile(fast_dds_profile())
    assert os.environ[VARIABLE] == used


def test_the_format_of_log_lines_is_the_launchers(tmp_path: Path) -> None:
    name = 'RCUTILS_CONSOLE_OUTPUT_FORMAT'
    assert graph_environment({name: '{message}'}, tmp_path)[name].startswith('[{severity}]')


def test_a_tilde_in_the_log_folder_is_the_home(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('HOME', str(tmp_path))
    monkeypatch.setenv('ROS_LOG_DIR', '~/logs')

    assert make_run_directory().parent == tmp_path / 'logs'


@pytest.mark.parametrize('variable', ['ROS_LOG_DIR', 'ROS_HOME', 'HOME'])
def test_the_logs_of_the_last_twenty_runs_are_kept(
    variable: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ('ROS_LOG_DIR', 'ROS_HOME'):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(variable, str(tmp_path))
    logs = tmp_path / {'ROS_LOG_DIR': '.', 'ROS_HOME': 'log', 'HOME': '.ros/log'}[variable]
    ended = [f'goalreach-2020-01-01-00-00-{second:02}-99999999' for second in range(30)]
    running = f'goalreach-2019-01-01-00-00-00-{os.getpid()}'
    others = ['goalreach-notes', 'goalreach-2019-01-01-1', 'python3_1_2019']
    for name in [*ended, running, *others]:
        (logs / name).mkdir(parents=True)
        (logs / name / 'nomad200.log').touch()

    new = make_run_directory()

    assert {path.name for path in logs.iterdir()} == {new.name, running, *others, *ended[-19:]}
