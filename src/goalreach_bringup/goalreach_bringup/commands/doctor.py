"""The `doctor` command: what goalreach runs on, and what would keep it from running."""

from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
import os
from pathlib import Path
import platform
import shutil
import subprocess
import sys
from typing import Any, Final

from goalreach_bringup.launch.environment import SHARED_MEMORY, abandoned_files, domain_lock
from goalreach_bringup.ros2cli.participants_file import count_local_participants
from goalreach_bringup.variables import check_variables
from goalreach_dashboard import bind
from goalreach_msgs_py.errors import GoalreachError

SUMMARY = 'Print what goalreach runs on, and what is wrong with it'

_ROS_PROBE: Final = """
import rclpy.utilities
print(rclpy.utilities.get_rmw_implementation_identifier(), 'in', rclpy.__path__[0])
"""
_NOT_INSTALLED: Final = 'not installed by pip'
_LEAST_SHARED_MB: Final = 64
"""Least free shared memory, MB: a segment of 16 MB (`fastdds.xml`) for each of four processes."""


def execute(_: Any) -> int:  # noqa: ANN401 - the command has no options
    """Print one line per finding; return 0 where nothing is wrong, else 1."""
    results = [_report(name, find) for name, find in _FINDINGS.items()]
    return 0 if all(results) else 1


def _report(name: str, find: Callable[[], str]) -> bool:
    try:
        print(f'ok     {name:<15}{find()}')
    except GoalreachError as error:
        print(f'wrong  {name:<15}{error}')
        return False
    return True


def _python() -> str:
    libc = ' '.join(platform.libc_ver())
    return f'{platform.python_version()} on {platform.machine()} with {libc}'


def _installed() -> str:
    return f'{_version("goalreach") or _NOT_INSTALLED}, from {Path(__file__).parents[2]}'


def _version(distribution: str) -> str | None:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return None


def _ros() -> str:
    command = [sys.executable, '-c', _ROS_PROBE]
    probe = subprocess.run(command, capture_output=True, text=True, check=False)
    if probe.returncode:
        reason = probe.stderr.strip().rpartition('\n')[2]
        raise GoalreachError(f'rclpy cannot be imported: {reason}')
    distribution = os.environ.get('ROS_DISTRO') or 'jazzy, from wheels'
    return f'{distribution}, {probe.stdout.strip()}'


def _variables() -> str:
    check_variables(os.environ)
    given = sorted(name for name in os.environ if name.startswith(('ROS_', 'RMW_', 'FAST')))
    return ', '.join(f'{name} = {os.environ[name]}' for name in given) or 'none is set'


def _domain() -> str:
    check_variables(os.environ)
    domain = int(os.environ.get('ROS_DOMAIN_ID') or 0)
    with domain_lock():
        return f'{domain}, {count_local_participants(domain)} participants on this machine'


def _shared_memory() -> str:
    free_mb = shutil.disk_usage(SHARED_MEMORY).free / 1e6
    left = len(abandoned_files())
    if free_mb < _LEAST_SHARED_MB:
        raise GoalreachError(f'{free_mb:.0f} MB free, at least {_LEAST_SHARED_MB} MB are needed')
    return f'{free_mb:.0f} MB free, {left} files of ended processes (removed by the next run)'


def _page() -> str:
    found = _version('nicegui')
    if found is None:
        raise GoalreachError('nicegui is missing; the live page needs the extra `dashboard`')
    with bind('127.0.0.1', None) as listener:
        return f'nicegui {found}, port {listener.getsockname()[1]} is free'


def _extras() -> str:
    names = ('gymnasium', 'distributed', 'pyarrow', 'stable-baselines3')
    return ', '.join(f'{name} {_version(name) or _NOT_INSTALLED}' for name in names)


_FINDINGS: Final[dict[str, Callable[[], str]]] = {
    'goalreach': _installed,
    'Python': _python,
    'ROS 2': _ros,
    'variables': _variables,
    'domain': _domain,
    'shared memory': _shared_memory,
    'live page': _page,
    'extras': _extras,
}
