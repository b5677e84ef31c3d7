"""Fast DDS profiles: which machines a graph can reach, and how quickly it is discovered."""

from collections.abc import Mapping
from importlib import resources
import os
from typing import Final

PROFILE_VARIABLE: Final = 'FASTRTPS_DEFAULT_PROFILES_FILE'
"""What Fast DDS 2 reads; `FASTDDS_DEFAULT_PROFILES_FILE` is the name of Fast DDS 3."""
_CONFIG: Final = resources.files('goalreach_msgs_py') / 'config'

DISCOVERY_PROFILE: Final = str(_CONFIG / 'fastdds_discovery.xml')
"""Profile of short-lived participants, such as the `ros2` commands and the recorder. It announces
them often: of 20 commands each, the slowest found a default node after 2.5 s without it and after
0.5 s with it."""


def fast_dds_profile(*, network: bool = False) -> str:
    """Return the path of the Fast DDS profile of the graph.

    Args:
        network: Whether other machines may take part; otherwise it is private to this one.
    """
    return str(_CONFIG / ('fastdds_network.xml' if network else 'fastdds.xml'))


def chosen_profile(environment: Mapping[str, str], default: str) -> str:
    """Return the path of the Fast DDS profile that the environment names, else the default."""
    newer = environment.get('FASTDDS_DEFAULT_PROFILES_FILE')
    return environment.get(PROFILE_VARIABLE) or newer or default


def use_profile(path: str) -> None:
    """Make a Fast DDS profile that of this process, unless the environment sets another.

    Args:
        path: Path of the profile.
    """
    os.environ[PROFILE_VARIABLE] = chosen_profile(os.environ, path)


def open_to_network() -> str:
    """Open the graphs of this process to the network; return a warning for the user."""
    os.environ[PROFILE_VARIABLE] = fast_dds_profile(network=True)
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    return (
        '--network: every machine that can reach this one may see the camera, drive the robot and '
        f'change parameters in ROS_DOMAIN_ID {domain}, unencrypted and without authentication'
    )
