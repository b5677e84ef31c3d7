"""Who can reach a graph is decided by one profile."""

import os
from pathlib import Path
import xml.etree.ElementTree as ET

import pytest

from goalreach_bringup.launch.environment import (
    domain_lock,
    graph_environment,
    make_run_directory,
    unused_domains,
)
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, open_to_network, use_profile
import graphs

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
    recorded = 'goalreach-2019-01-02-00-00-00-99999999'
    others = ['goalreach-notes', 'goalreach-2019-01-01-1', 'python3_1_2019']
    others += [recorded, 'goalreach-2019-01-03-00-00-00-99999999']
    for name in [*ended, running, *others[:-1]]:
        (logs / name).mkdir(parents=True)
        (logs / name / 'nomad200.log').touch()
    (logs / recorded / 'bag_1').mkdir()
    (logs / others[-1]).symlink_to('elsewhere')

    new = make_run_directory()

    assert {path.name for path in logs.iterdir()} == {new.name, running, *others, *ended[-19:]}


def test_a_folder_that_cannot_be_made_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_LOG_DIR', '/proc/x')
    with pytest.raises(GoalreachError, match=r'^/proc/x/goalreach-.*: cannot be created: '):
        make_run_directory()


@pytest.mark.parametrize('number', ['', '7'])
def test_a_lock_that_the_system_refuses_is_told(
    number: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', number)
    refusal = pytest.raises(GoalreachError, match=f'^ROS_DOMAIN_ID = {number or 0}: cannot be')
    with refusal, domain_lock('x' * 200):  # longer than the name of a socket
        pass


def test_one_run_of_a_namespace_and_one_clock_of_a_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    domain = graphs.fresh_domain()
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
    with domain_lock('robot1') as owns_clock:
        assert owns_clock
        with domain_lock('robot2') as owns_too:
            assert not owns_too
            assert domain not in unused_domains(domain)
        for namespace, where in (('robot1', 'in /robot1'), ('', 'there')):
            refusal = pytest.raises(GoalreachError, match=f'another graph runs {where} ')
            with refusal, domain_lock(namespace):
                pass
    with domain_lock() as owns_clock:
        assert owns_clock
    assert next(unused_domains(domain)) == domain


def test_domains_end_with_the_highest_of_dds() -> None:
    assert set(unused_domains(230)) <= {230, 231, 232}
    assert 232 in unused_domains(230)
