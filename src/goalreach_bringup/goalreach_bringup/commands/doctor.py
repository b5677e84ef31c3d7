"""The `doctor` command: reports the environment of goalreach, and problems in it."""

from collections.abc import Callable
import contextlib
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
import os
from pathlib import Path
import platform
import shutil
import subprocess
import sys
from typing import Any, Final
import webbrowser

from goalreach_bringup.launch.auxiliary_processes import require_page
from goalreach_bringup.launch.environment import SHARED_MEMORY, abandoned_files, domain_lock
from goalreach_bringup.variables import check_variables
from goalreach_dashboard.address import bind
from goalreach_msgs_py.errors import GoalreachError, one_line
from goalreach_msgs_py.ros.dds_profile import count_local_participants, domain_ports
from goalreach_msgs_py.ros.distribution import installed

SUMMARY = 'Report the environment of goalreach, and problems in it'

_ROS_PROBE: Final = """
import rclpy.utilities
print('rclpy in', rclpy.__path__[0], 'on', rclpy.utilities.get_rmw_implementation_identifier())
"""
_PREFIXES: Final = ('FAST', 'RCL_', 'RCUTILS_', 'RMW_', 'ROS_', 'SKIP_', 'TMPDIR')
_OPTIONAL: Final = ('live page', 'browser')
"""Findings that a run can do without."""
_LEAST_SHARED_MB: Final = 64
"""Least free shared memory, MB: a segment of 16 MB (`fastdds.xml`) for each of four processes."""


def execute(_: Any) -> int:  # noqa: ANN401 - the command has no options
    """Print one line per finding; return 0 where nothing is wrong, else 1."""
    results = [_report(name, find) for name, find in _FINDINGS.items()]
    return 0 if all(results) else 1


def _report(name: str, find: Callable[[], str]) -> bool:
    level = 'ok'
    try:
        line = find()
    except GoalreachError as error:
        line, level = str(error), 'warn' if name in _OPTIONAL else 'wrong'
    print(f'{level:<7}{name:<15}{one_line(line)}')
    return level != 'wrong'


def _python() -> str:
    libc = ' '.join(platform.libc_ver())
    return f'{platform.python_version()} on {platform.machine()} with {libc}'


def _installed() -> str:
    return f'{_version("goalreach")}, from {Path(__file__).parents[2]}'


def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return 'not installed by pip'


def _ros() -> str:
    command = [sys.executable, '-c', _ROS_PROBE]
    environment = {k: v for k, v in os.environ.items() if not k.startswith(_PREFIXES)}
    probe = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if probe.returncode:
        reason = probe.stderr.strip().rpartition('\n')[2]
        raise GoalreachError(f'rclpy cannot be imported: {reason}; reinstall goalreach')
    wheels, name = find_spec('ros_wheels_bootstrapper'), installed().name
    distribution = f'{name}, from wheels' if wheels else os.environ.get('ROS_DISTRO') or name
    return f'{distribution}, {probe.stdout.strip()}'


def _variables() -> str:
    check_variables(os.environ, starts_graph=True)
    given = sorted(name for name in os.environ if name.startswith(_PREFIXES))
    return ', '.join(f'{name} = {os.environ[name]}' for name in given) or 'none is set'


def _domain() -> str:
    check_variables(os.environ, only='ROS_DOMAIN_ID')
    domain = int(os.environ.get('ROS_DOMAIN_ID') or 0)
    with domain_lock():
        count = count_local_participants(domain)
    ports = domain_ports(domain)
    return f'{domain}, UDP ports {ports[0]} to {ports[-1]}, {count} participants on this machine'


def _shared_memory() -> str:
    free_mb = shutil.disk_usage(SHARED_MEMORY).free / 1e6 if SHARED_MEMORY.is_dir() else 0.0
    left = len(abandoned_files())
    if free_mb < _LEAST_SHARED_MB:
        raise GoalreachError(
            f'{free_mb:.0f} MB free, at least {_LEAST_SHARED_MB} MB are needed: remove files from '
            f'{SHARED_MEMORY}, or start the container with --shm-size=256m'
        )
    return f'{free_mb:.0f} MB free, {left} files of ended processes (removed by the next run)'


def _page() -> str:
    require_page()
    with bind('127.0.0.1', None) as listener:
        return f'starlette {_version("starlette")}, port {listener.getsockname()[1]} is free'


def _browser() -> str:
    with contextlib.suppress(webbrowser.Error):
        return str(getattr(webbrowser.get(), 'name', 'found'))
    raise GoalreachError('none found: open the link of the live page through `ssh -L`')


def _extras() -> str:
    names = ('gymnasium', 'distributed', 'stable-baselines3')
    return ', '.join(f'{name} {_version(name)}' for name in names)


_FINDINGS: Final[dict[str, Callable[[], str]]] = {
    'goalreach': _installed,
    'Python': _python,
    'ROS 2': _ros,
    'variables': _variables,
    'domain': _domain,
    'shared memory': _shared_memory,
    'live page': _page,
    'browser': _browser,
    'extras': _extras,
}
