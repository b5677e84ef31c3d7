"""Environment variables that ROS 2 and Fast DDS read, checked before anything starts.

A bad value would otherwise show as a traceback, as text of the middleware, or not at all. The
names and values are those of rcl, rmw and Fast DDS in Jazzy.
"""

from collections.abc import Callable, Mapping
import contextlib
from importlib.util import find_spec
import os
from os.path import abspath, expanduser, isdir, isfile
from pathlib import Path
import re
import socket
import sys
import threading
from typing import Final

from goalreach_msgs_py.errors import ConfigurationError, one_line

HIGHEST_DOMAIN: Final = 232
"""Highest domain whose ports are below 65536 (DDSI-RTPS 2.2, 9.6.1.1)."""

Check = Callable[[str, Mapping[str, str]], str]
"""Returns what is allowed where the value is not, else an empty text."""

_RESOLUTION_S: Final = 2.0
"""Longest wait for the addresses of host names. Chosen."""
_LONGEST_TMPDIR: Final = 75
"""The path of a Unix socket has at most 107 bytes (unix(7)), and that of `multiprocessing` ends in
/pymp-xxxxxxxx/listener-xxxxxxxx."""


def check_variables(
    environment: Mapping[str, str], *, starts_graph: bool = False, only: str = ''
) -> None:
    """Check the variables that are set, or `only` one; an empty one counts as not set.

    A graph of this machine's own would wait without end for a discovery server that does not run,
    so none may be given where one is started.

    Raises:
        ConfigurationError: A value is refused; the error names variable, value and what is
            allowed.
    """
    for name, check in (_CHECKS | (_OF_ANOTHER_GRAPH if starts_graph else {})).items():
        value = environment.get(name, '')
        asked = (value or name == 'HOME') and only in {'', name}
        if asked and (allowed := check(value, environment)):
            raise ConfigurationError(name, value, allowed)


def _one_of(*values: str) -> Check:
    return lambda value, _: '' if value in values else 'one of ' + ', '.join(values)


def _domain(value: str, _: Mapping[str, str]) -> str:
    good = value in map(str, range(HIGHEST_DOMAIN + 1))  # rcl reads 010 as 8
    return '' if good else f'a whole number in [0, {HIGHEST_DOMAIN}]'


def _middleware(value: str, environment: Mapping[str, str]) -> str:
    folders = [f for f in environment.get('LD_LIBRARY_PATH', '').split(os.pathsep) if f]
    library = one_line(f'lib{value}.so')
    good = '/' not in value and any(Path(folder, library).is_file() for folder in folders)
    if good or value == 'rmw_fastrtps_cpp':
        return ''
    return f'rmw_fastrtps_cpp, or another one that is installed ({library} was not found)'


def _profile(value: str, _: Mapping[str, str]) -> str:
    from xml.etree import ElementTree as ET

    root = ''
    with contextlib.suppress(OSError, ET.ParseError, ValueError, LookupError):
        if isfile(value):  # a pipe would be waited for
            root = ET.parse(value).getroot().tag  # noqa: S314 - Fast DDS reads it anyway
    good = root.rpartition('}')[2] in ('dds', 'profiles')
    return '' if good else 'an XML file of Fast DDS profiles that can be read'


def _folder(value: str, _: Mapping[str, str]) -> str:
    path = Path(expanduser(value)).absolute()
    try:
        value.encode()  # rclpy takes UTF-8 only
        while not path.exists():
            path = path.parent
        good = path.is_dir() and os.access(path, os.W_OK | os.X_OK)
    except (OSError, ValueError):
        good = False
    return '' if good else 'a folder that can be written'


def _home(value: str, environment: Mapping[str, str]) -> str:
    if environment.get('ROS_HOME') or environment.get('ROS_LOG_DIR'):
        return ''
    bad = not value or _folder(value, environment)
    return 'a folder that can be written (or set ROS_LOG_DIR)' if bad else ''


def _temporary(value: str, _: Mapping[str, str]) -> str:
    path = abspath(value)
    good = len(os.fsencode(path)) <= _LONGEST_TMPDIR or not isdir(path)
    return '' if good else f'a path of at most {_LONGEST_TMPDIR} bytes: sockets are made there'


def _peers(value: str, _: Mapping[str, str]) -> str:
    found = threading.Event()

    def resolve() -> None:
        with contextlib.suppress(OSError, UnicodeError):
            for peer in filter(None, value.split(';')):
                socket.getaddrinfo(peer, None, socket.AF_INET)
            found.set()

    threading.Thread(target=resolve, daemon=True).start()  # a name server may not answer
    names = f'IPv4 addresses or host names that are resolved within {_RESOLUTION_S:g} s'
    return '' if found.wait(_RESOLUTION_S) else f'{names}, separated by semicolons'


def _matching(pattern: str, allowed: str) -> Check:
    return lambda value, _: '' if re.fullmatch(pattern, value, re.ASCII) else allowed


def _keystore(value: str, environment: Mapping[str, str]) -> str:
    enclave = environment.get('ROS_SECURITY_ENCLAVE_OVERRIDE', '')
    good = isdir(f'{value}/enclaves/{enclave}')
    if good or environment.get('ROS_SECURITY_ENABLE') != 'true':
        return ''
    return f'a keystore with a folder {one_line(f"enclaves/{enclave}")}'


def _security(value: str, environment: Mapping[str, str]) -> str:
    if value == 'true' and not environment.get('ROS_SECURITY_KEYSTORE'):
        return 'false, or set ROS_SECURITY_KEYSTORE too'
    if value == 'true' and find_spec('ros_wheels_bootstrapper'):
        return 'false: ROS 2 from wheels has no security plug-ins (SECURITY.md)'
    return _one_of('true', 'false')(value, environment)


def _bootstrapped(_: str, environment: Mapping[str, str]) -> str:
    own = f'{sys.prefix}/lib' in environment.get('LD_LIBRARY_PATH', '').split(os.pathsep)
    return (
        '' if own or not find_spec('ros_wheels_bootstrapper') else 'unset: another Python set it'
    )


def _same(value: str, environment: Mapping[str, str]) -> str:
    used = environment.get('RMW_IMPLEMENTATION') or 'rmw_fastrtps_cpp'
    return '' if value == used else f'the middleware in use, {used}'


_CHECKS: Final[dict[str, Check]] = {
    '_ROS_WHEELS_BOOTSTRAP_COMPLETE': _bootstrapped,
    'ROS_DOMAIN_ID': _domain,
    'RMW_IMPLEMENTATION': _middleware,
    'RCL_ASSERT_RMW_ID_MATCHES': _same,
    'ROS_AUTOMATIC_DISCOVERY_RANGE': _matching(
        'LOCALHOST|SUBNET|SYSTEM_DEFAULT',
        'one of LOCALHOST, SUBNET, SYSTEM_DEFAULT (with OFF nodes cannot find each other)',
    ),
    'ROS_STATIC_PEERS': _peers,
    'FASTRTPS_DEFAULT_PROFILES_FILE': _profile,
    'FASTDDS_DEFAULT_PROFILES_FILE': _profile,
    'FASTDDS_ENVIRONMENT_FILE': lambda value, _: '' if isfile(value) else 'a file',
    'FASTDDS_BUILTIN_TRANSPORTS': _matching(
        r'(DEFAULT|UDP)v[46]|DEFAULT|SHM|LARGE_DATA(v6)?(\?[\w=&]+)?',
        'one of DEFAULT, DEFAULTv6, SHM, UDPv4, UDPv6, LARGE_DATA, LARGE_DATAv6',
    ),
    'ROS_DISCOVERY_SERVER': _matching(
        r';*[\w.:\[\]-]+(;[\w.:\[\]-]*)*', 'addresses of servers, separated by semicolons'
    ),
    'ROS_SUPER_CLIENT': _one_of('true', 'True', 'TRUE', '1', 'false', 'False', 'FALSE', '0'),
    'RMW_FASTRTPS_PUBLICATION_MODE': _one_of('AUTO', 'SYNCHRONOUS', 'ASYNCHRONOUS'),
    'HOME': _home,
    'ROS_HOME': _folder,
    'ROS_LOG_DIR': _folder,
    'TMPDIR': _temporary,
    'ROS_SECURITY_ENABLE': _security,
    'ROS_SECURITY_STRATEGY': _one_of('Enforce', 'Permissive'),
    'ROS_SECURITY_KEYSTORE': _keystore,
    'ROS_SECURITY_ENCLAVE_OVERRIDE': _matching('/.*', 'a name that begins with a slash'),
    **dict.fromkeys(
        (
            'RCL_LOGGING_SPDLOG_EXPERIMENTAL_OLD_FLUSHING_BEHAVIOR',
            'RCUTILS_COLORIZED_OUTPUT', 'RCUTILS_LOGGING_BUFFERED_STREAM',
            'RCUTILS_LOGGING_USE_STDOUT', 'RMW_FASTRTPS_USE_QOS_FROM_XML',
            'ROS_DISABLE_LOANED_MESSAGES', 'ROS_LOCALHOST_ONLY', 'SKIP_DEFAULT_XML_FILE',
        ),
        _one_of('0', '1'),
    ),
}  # fmt: skip
_OF_ANOTHER_GRAPH: Final[dict[str, Check]] = dict.fromkeys(
    ('ROS_DISCOVERY_SERVER', 'FASTDDS_ENVIRONMENT_FILE'),
    lambda *_: 'unset: the nodes of a run find each other without a server',
)
