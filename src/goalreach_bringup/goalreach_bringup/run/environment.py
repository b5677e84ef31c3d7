"""The environment that makes a graph quick, complete and private to this machine."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
import os
from pathlib import Path
import time

from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros_node import LAUNCHER_PID

__all__ = ['fast_dds_profile', 'graph_environment', 'make_run_directory', 'open_to_network']

_PROFILE = 'fastdds.xml'
_NETWORK_PROFILE = 'fastdds_network.xml'


def fast_dds_profile(*, network: bool = False) -> str:
    """Return the path of the Fast DDS profile of the graph.

    Args:
        network: Whether other machines may take part; else it is private to this one.
    """
    name = _NETWORK_PROFILE if network else _PROFILE
    return str(resources.files('goalreach_bringup') / 'config' / name)


def open_to_network() -> str:
    """Open the graphs of this process to the network; return the line that tells what it means."""
    os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'] = fast_dds_profile(network=True)
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    return (
        f'--network: every machine that reaches this one can see the camera, drive the robot and '
        f'change parameters in ROS_DOMAIN_ID {domain}; nothing is encrypted and nobody is asked '
        'who he is'
    )


def graph_environment(base: Mapping[str, str], log_directory: Path) -> dict[str, str]:
    """Return the environment of the graph's processes.

    A Fast DDS profile that the person has set already is kept.

    Args:
        base: The environment to start from.
        log_directory: Where ROS writes its own logs.
    """
    environment = dict(base)
    environment.setdefault('FASTRTPS_DEFAULT_PROFILES_FILE', fast_dds_profile())
    environment['ROS_PYTHON_CHECK_FIELDS'] = '1'
    environment['ROS_LOG_DIR'] = str(log_directory)
    environment['RCUTILS_LOGGING_USE_STDOUT'] = '0'
    environment['RCUTILS_COLORIZED_OUTPUT'] = '0'
    environment['PYTHONUNBUFFERED'] = '1'
    for name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
        environment.setdefault(name, '1')
    environment[LAUNCHER_PID] = str(os.getpid())
    return environment


def make_run_directory() -> Path:
    """Make and return the directory of this run's logs, where ROS keeps its logs.

    Raises:
        GoalreachError: It cannot be made.
    """
    home = os.environ.get('ROS_HOME') or str(Path.home() / '.ros')
    base = Path(os.environ.get('ROS_LOG_DIR') or Path(home) / 'log')
    stamp = time.strftime('%Y-%m-%d-%H-%M-%S')
    directory = base / f'goalreach-{stamp}-{os.getpid()}'
    try:
        directory.mkdir(parents=True)
    except OSError as error:
        raise GoalreachError(f'{directory}: cannot be made: {error.strerror}') from None
    return directory
