"""Environment variables that ROS 2 and Fast DDS read, checked before anything starts.

A bad value would otherwise show as a traceback, as text of the middleware, or not at all. The
names and values are those of rcl, rmw and Fast DDS in Jazzy.
"""

from collections.abc import Callable, Mapping
import os
from pathlib import Path
import socket
from typing import Final
from xml.etree import ElementTree as ET

from goalreach_msgs_py.errors import ConfigurationError, one_line

HIGHEST_DOMAIN: Final = 232
"""Highest domain whose ports are below 65536 (DDSI-RTPS 2.2, 9.6.1.1)."""

Check = Callable[[str, Mapping[str, str]], str]
"""Returns what is allowed where the value is not, else an empty text."""


def check_variables(environment: Mapping[str, str]) -> None:
    """Check the variables that are set; an empty one counts as not set.

    Args:
        environment: Environment variables by name.

    Raises:
        ConfigurationError: A value is refused; the error names variable, value and what is
            allowed.
    """
    for name, check in _CHECKS.items():
        value = environment.get(name)
        if value and (allowed := check(value, environment)):
            raise ConfigurationError(name, value, allowed)
    if not any(environment.get(name) for name in ('HOME', 'ROS_HOME', 'ROS_LOG_DIR')):
        raise ConfigurationError('HOME', environment.get('HOME'), 'a folder (or set ROS_LOG_DIR)')


def _one_of(*values: str) -> Check:
    return lambda value, _: '' if value in values else 'one of ' + ', '.join(values)


def _domain(value: str, _: Mapping[str, str]) -> str:
    good = value in map(str, range(HIGHEST_DOMAIN + 1))  # rcl reads 010 as 8
    return '' if good else f'a whole number in [0, {HIGHEST_DOMAIN}]'


def _discovery_range(value: str, _: Mapping[str, str]) -> str:
    allowed = ('LOCALHOST', 'SUBNET', 'SYSTEM_DEFAULT')
    reason = ' (with OFF the nodes of a graph cannot find each other)' if value == 'OFF' else ''
    return '' if value in allowed else f'one of {", ".join(allowed)}{reason}'


def _middleware(value: str, environment: Mapping[str, str]) -> str:
    folders = [f for f in environment.get('LD_LIBRARY_PATH', '').split(os.pathsep) if f]
    library = one_line(f'lib{value}.so')
    good = '/' not in value and any(Path(folder, library).is_file() for folder in folders)
    if good or value == 'rmw_fastrtps_cpp':
        return ''
    return f'rmw_fastrtps_cpp, or another one that is installed ({library} was not found)'


def _profile(value: str, _: Mapping[str, str]) -> str:
    path = Path(value)
    try:
        ET.parse(path)  # noqa: S314 - the middleware reads the user's own file anyway
    except (OSError, ET.ParseError, ValueError):
        return 'an XML file of Fast DDS profiles that can be read'
    return ''


def _folder(value: str, _: Mapping[str, str]) -> str:
    path = Path(value).expanduser().absolute()
    try:
        while not path.exists():
            path = path.parent
        good = path.is_dir() and os.access(path, os.W_OK | os.X_OK)
    except (OSError, ValueError):
        good = False
    return '' if good else 'a folder that can be written'


def _peers(value: str, _: Mapping[str, str]) -> str:
    try:
        for peer in value.split(';'):
            socket.getaddrinfo(peer or ' ', None)
    except (OSError, UnicodeError):
        return 'addresses or host names that can be resolved, separated by semicolons'
    return ''


def _keystore(value: str, environment: Mapping[str, str]) -> str:
    if environment.get('ROS_SECURITY_ENABLE') != 'true':
        return ''
    return '' if Path(value).is_dir() else 'an existing folder, as ROS_SECURITY_ENABLE = true'


def _security(value: str, environment: Mapping[str, str]) -> str:
    if value == 'true' and not environment.get('ROS_SECURITY_KEYSTORE'):
        return 'false, or set ROS_SECURITY_KEYSTORE too'
    return _one_of('true', 'false')(value, environment)


_FLAG: Final = _one_of('0', '1')
_CHECKS: Final[Mapping[str, Check]] = {
    'ROS_DOMAIN_ID': _domain,
    'RMW_IMPLEMENTATION': _middleware,
    'ROS_AUTOMATIC_DISCOVERY_RANGE': _discovery_range,
    'ROS_STATIC_PEERS': _peers,
    'ROS_LOCALHOST_ONLY': _FLAG,
    'FASTRTPS_DEFAULT_PROFILES_FILE': _profile,
    'FASTDDS_DEFAULT_PROFILES_FILE': _profile,
    'SKIP_DEFAULT_XML': _FLAG,
    'RMW_FASTRTPS_USE_QOS_FROM_XML': _FLAG,
    'RMW_FASTRTPS_PUBLICATION_MODE': _one_of('AUTO', 'SYNCHRONOUS', 'ASYNCHRONOUS'),
    'ROS_HOME': _folder,
    'ROS_LOG_DIR': _folder,
    'RCUTILS_LOGGING_USE_STDOUT': _FLAG,
    'RCUTILS_LOGGING_BUFFERED_STREAM': _FLAG,
    'RCUTILS_COLORIZED_OUTPUT': _FLAG,
    'ROS_SECURITY_ENABLE': _security,
    'ROS_SECURITY_STRATEGY': _one_of('Enforce', 'Permissive'),
    'ROS_SECURITY_KEYSTORE': _keystore,
}
