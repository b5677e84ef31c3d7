from __future__ import annotations

import contextlib
from importlib.util import find_spec
import os
from pathlib import Path
import re
import socket
import subprocess
import sys
import threading

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_bringup import cli, variables
from goalreach_bringup.variables import check_variables
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.ros import dds_profile

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
        ('RMW_IMPLEMENTATION', 'z', 'libz.so was not found'),
        ('RCL_ASSERT_RMW_ID_MATCHES', 'a', 'the middleware in use, rmw_fastrtps_cpp'),
        ('ROS_SECURITY_ENABLE', 'yes', 'one of true, false'),
        ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF', 'cannot find each other'),
        ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'localhost', 'one of LOCALHOST, SUBNET'),
        ('ROS_STATIC_PEERS', '127.0.0.1; 127.0.0.1', 'separated by semicolons'),
        ('ROS_STATIC_PEERS', '::1', 'IPv4 addresses or host names'),
        ('ROS_LOCALHOST_ONLY', 'yes', 'one of 0, 1'),
        ('FASTRTPS_DEFAULT_PROFILES_FILE', '/no/such.xml', 'an XML file'),
        ('FASTDDS_DEFAULT_PROFILES_FILE', '/etc/hostname', 'an XML file'),
        ('FASTRTPS_DEFAULT_PROFILES_FILE', '/dev/zero', 'an XML file'),
        ('FASTDDS_DEFAULT_PROFILES_FILE', '/etc', 'an XML file'),
        ('FASTDDS_ENVIRONMENT_FILE', '/no/such.json', 'a file'),
        ('FASTDDS_BUILTIN_TRANSPORTS', 'NONE', 'one of DEFAULT'),
        ('ROS_DISCOVERY_SERVER', ';', 'addresses of servers'),
        ('ROS_SUPER_CLIENT', 'yes', 'one of true'),
        ('SKIP_DEFAULT_XML_FILE', 'yes', 'one of 0, 1'),
        ('RCL_ASSERT_RMW_ID_MATCHES', 'rmw_x', 'the middleware in use, rmw_fastrtps_cpp'),
        ('RCL_LOGGING_SPDLOG_EXPERIMENTAL_OLD_FLUSHING_BEHAVIOR', 'x', 'one of 0, 1'),
        ('HOME', '/dev/null', 'a folder that can be written (or set ROS_LOG_DIR)'),
        ('ROS_LOG_DIR', '/\udcff', 'a folder that can be written'),
        ('ROS_HOME', '/dev/null/x', 'a folder that can be written'),
        ('ROS_LOG_DIR', '/etc/hostname', 'a folder that can be written'),
        ('RCUTILS_LOGGING_BUFFERED_STREAM', '9', 'one of 0, 1'),
        ('ROS_SECURITY_ENABLE', 'true', 'false, or set ROS_SECURITY_KEYSTORE too'),
        ('ROS_SECURITY_ENCLAVE_OVERRIDE', 'robot', 'begins with a slash'),
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
        ('ROS_STATIC_PEERS', '127.0.0.1;;localhost'),
        ('ROS_DISCOVERY_SERVER', ';10.0.0.2:11811;[::1]:11812'),
        ('FASTDDS_BUILTIN_TRANSPORTS', 'LARGE_DATA?max_msg_size=200KB'),
        ('ROS_LOG_DIR', '~nobody-of-this-name/x'),
        ('FASTDDS_DEFAULT_PROFILES_FILE', dds_profile.DISCOVERY_PROFILE),
        ('ROS_SECURITY_ENABLE', 'false'),
        ('ROS_SECURITY_KEYSTORE', '/no'),
        ('RCL_ASSERT_RMW_ID_MATCHES', 'rmw_fastrtps_cpp'),
        ('TMPDIR', '/'),
    ],
)
def test_a_good_value_is_accepted(name: str, value: str) -> None:
    check_variables({**HOME, name: value})


@pytest.mark.parametrize('name', ['ROS_DISCOVERY_SERVER', 'FASTDDS_ENVIRONMENT_FILE'])
def test_a_run_uses_no_discovery_server(name: str, tmp_path: Path) -> None:
    path = tmp_path / '127.0.0.1'
    path.touch()
    environment = {**HOME, name: str(path) if name.endswith('FILE') else '127.0.0.1:11811'}

    check_variables(environment)
    with pytest.raises(ConfigurationError, match=f'^{name} = .* must be unset: the nodes'):
        check_variables(environment, starts_graph=True)


@pytest.mark.parametrize('content', [None, '', '<dds', '<a/>'])
def test_a_profile_is_a_file_of_profiles(content: str | None, tmp_path: Path) -> None:
    """Opening a pipe waits for a writer; of another document Fast DDS takes nothing."""
    path = tmp_path / 'profile.xml'
    if content is None:
        os.mkfifo(path)
    else:
        path.write_text(content)

    with pytest.raises(ConfigurationError, match='an XML file of Fast DDS profiles'):
        check_variables({**HOME, 'FASTRTPS_DEFAULT_PROFILES_FILE': str(path)})


def test_a_name_server_that_does_not_answer_is_not_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    answered = threading.Event()
    monkeypatch.setattr(socket, 'getaddrinfo', lambda *_: answered.wait())

    with pytest.raises(ConfigurationError, match='resolved within 2 s'):
        check_variables({**HOME, 'ROS_STATIC_PEERS': 'robot.example'})
    answered.set()


def test_sockets_fit_into_the_temporary_folder(tmp_path: Path) -> None:
    longest = Path(os.path.realpath(tmp_path))
    longest /= 'x' * (variables._LONGEST_TMPDIR - 1 - len(str(longest)))
    for folder in (longest, longest.with_name(longest.name + 'x')):
        folder.mkdir()

    check_variables({**HOME, 'TMPDIR': f'{longest}/not/there'})
    check_variables({**HOME, 'TMPDIR': str(longest)})
    with pytest.raises(ConfigurationError, match=r'^TMPDIR = .* at most 75 bytes'):
        check_variables({**HOME, 'TMPDIR': f'{longest}x'})


@pytest.mark.skipif(not find_spec('ros_wheels_bootstrapper'), reason='ROS 2 is not from wheels')
@pytest.mark.parametrize(('paths', 'good'), [(f'/x:{sys.prefix}/lib', True), ('/x/lib', False)])
def test_libraries_of_another_environment_are_refused(paths: str, good: object) -> None:
    """The wheels set both variables, once, for all that a process starts."""
    environment = {**HOME, '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1', 'LD_LIBRARY_PATH': paths}
    refusal = pytest.raises(ConfigurationError, match='another Python')

    with contextlib.nullcontext() if good else refusal:
        check_variables(environment)


@pytest.mark.skipif(not find_spec('ros_wheels_bootstrapper'), reason='ROS 2 is not from wheels')
def test_the_wheels_have_no_security(tmp_path: Path) -> None:
    secured = {**HOME, 'ROS_SECURITY_ENABLE': 'true', 'ROS_SECURITY_KEYSTORE': str(tmp_path)}

    with pytest.raises(ConfigurationError, match='no security plug-ins'):
        check_variables(secured)


@pytest.mark.parametrize(
    ('enclave', 'good'), [('', True), ('/goalreach', True), ('/another', False)]
)
def test_an_enclave_is_in_its_keystore(
    enclave: str, good: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(variables, 'find_spec', lambda _: None)  # as on a full installation
    (tmp_path / 'enclaves' / 'goalreach').mkdir(parents=True)
    secured = {**HOME, 'ROS_SECURITY_ENABLE': 'true', 'ROS_SECURITY_KEYSTORE': str(tmp_path)}
    refusal = pytest.raises(ConfigurationError, match='a keystore with a folder enclaves/')

    with contextlib.nullcontext() if good else refusal:
        check_variables({**secured, 'ROS_SECURITY_ENCLAVE_OVERRIDE': enclave})


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
        ('RCL_ASSERT_RMW_ID_MATCHES', 'rmw_cyclonedds_cpp'),
        ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF'),
        ('ROS_DISCOVERY_SERVER', '127.0.0.1:11811'),
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


def test_a_log_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    """Not even root may write there, which no look at the permissions shows."""
    done = subprocess.run(
        [sys.executable, '-m', 'goalreach_bringup.cli', 'run', '--paths', '1'],
        cwd=tmp_path,
        env={**os.environ, 'ROS_LOG_DIR': '/proc/x'},
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
    )

    assert done.returncode == 2
    assert re.fullmatch(
        'goalreach run: /proc/x/goalreach-.*: cannot be created: .*\n', done.stderr
    )
