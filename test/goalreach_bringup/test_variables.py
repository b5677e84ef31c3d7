from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_bringup import cli
from goalreach_bringup.variables import check_variables
from goalreach_msgs_py.errors import ConfigurationError

HOME = {'HOME': '/'}
NAMES = (
    'FASTDDS_DEFAULT_PROFILES_FILE',
    'RCUTILS_COLORIZED_OUTPUT',
    'RMW_IMPLEMENTATION',
    'ROS_AUTOMATIC_DISCOVERY_RANGE',
    'ROS_DOMAIN_ID',
    'ROS_LOCALHOST_ONLY',
    'ROS_LOG_DIR',
    'ROS_SECURITY_ENABLE',
)


@pytest.mark.parametrize(
    ('name', 'value', 'allowed'),
    [
        ('ROS_DOMAIN_ID', 'abc', 'a whole number in [0, 232]'),
        ('ROS_DOMAIN_ID', '-1', 'a whole number in [0, 232]'),
        ('ROS_DOMAIN_ID', '233', 'a whole number in [0, 232]'),
        ('ROS_DOMAIN_ID', '010', 'a whole number in [0, 232]'),
        ('ROS_DOMAIN_ID', '٣', 'a whole number in [0, 232]'),
        ('RMW_IMPLEMENTATION', 'rmw_cyclonedds_cpp', 'librmw_cyclonedds_cpp.so was not found'),
        ('RMW_IMPLEMENTATION', 'a\nb', 'liba?b.so was not found'),
        ('RMW_IMPLEMENTATION', '../x', 'rmw_fastrtps_cpp, or another'),
        ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF', 'cannot find each other'),
        ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'localhost', 'one of LOCALHOST, SUBNET'),
        ('ROS_STATIC_PEERS', '127.0.0.1;;10.0.0.1', 'separated by semicolons'),
        ('ROS_LOCALHOST_ONLY', 'yes', 'one of 0, 1'),
        ('FASTRTPS_DEFAULT_PROFILES_FILE', '/no/such.xml', 'an XML file'),
        ('FASTDDS_DEFAULT_PROFILES_FILE', '/etc/hostname', 'an XML file'),
        ('ROS_HOME', '/dev/null/x', 'a folder that can be written'),
        ('ROS_LOG_DIR', '/etc/hostname', 'a folder that can be written'),
        ('RCUTILS_LOGGING_BUFFERED_STREAM', '9', 'one of 0, 1'),
        ('ROS_SECURITY_ENABLE', 'true', 'false, or set ROS_SECURITY_KEYSTORE too'),
        ('ROS_SECURITY_STRATEGY', 'enforce', 'one of Enforce, Permissive'),
    ],
)
def test_a_bad_value_is_refused_with_what_is_allowed(name: str, value: str, allowed: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        check_variables({**HOME, name: value})

    line = str(caught.value)
    assert line.startswith(f'{name} = ')
    assert allowed in line
    assert '\n' not in line


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('ROS_DOMAIN_ID', '0'),
        ('ROS_DOMAIN_ID', '232'),
        ('ROS_DOMAIN_ID', ''),
        ('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp'),
        ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET'),
        ('ROS_STATIC_PEERS', '127.0.0.1;localhost'),
        ('ROS_SECURITY_ENABLE', 'false'),
    ],
)
def test_a_good_value_is_accepted(name: str, value: str) -> None:
    check_variables({**HOME, name: value})


def test_another_middleware_is_accepted_where_its_library_is(tmp_path: Path) -> None:
    (tmp_path / 'librmw_zenoh_cpp.so').touch()
    check_variables(
        {**HOME, 'RMW_IMPLEMENTATION': 'rmw_zenoh_cpp', 'LD_LIBRARY_PATH': f'/x:{tmp_path}'}
    )


def test_a_home_is_needed_only_for_logs() -> None:
    with pytest.raises(ConfigurationError, match=r'^HOME = '):
        check_variables({})
    check_variables({'ROS_LOG_DIR': '/'})


@given(st.dictionaries(st.sampled_from(NAMES), st.text(st.characters(exclude_characters='\0'))))
def test_any_combination_is_accepted_or_refused_in_one_line(environment: dict[str, str]) -> None:
    refused = ''
    try:
        check_variables({**HOME, **environment})
    except ConfigurationError as error:
        refused = str(error)
    assert '\n' not in refused


@pytest.mark.parametrize('command', cli.ROS_COMMANDS)
def test_every_ros_command_checks_first(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', 'abc')

    assert cli.main([command]) == 2
    expected = f"goalreach {command}: ROS_DOMAIN_ID = 'abc': must be a whole number in [0, 232]\n"
    assert capsys.readouterr().err == expected


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('ROS_DOMAIN_ID', 'abc'),
        ('ROS_DOMAIN_ID', '500'),
        ('ROS_DOMAIN_ID', '-1'),
        ('RMW_IMPLEMENTATION', 'rmw_cyclonedds_cpp'),
        ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF'),
    ],
)
def test_a_run_with_a_bad_variable_starts_nothing(name: str, value: str, tmp_path: Path) -> None:
    """The variable is in the environment of a real process, before ROS is imported there."""
    done = subprocess.run(
        [sys.executable, '-m', 'goalreach_bringup.cli', 'run', '--paths', '1'],
        env={**os.environ, 'ROS_LOG_DIR': str(tmp_path), name: value},
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
    )

    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr.startswith(f'goalreach run: {name} = {value!r}: must be ')
    assert done.stderr.count('\n') == 1
    assert not list(tmp_path.iterdir())
