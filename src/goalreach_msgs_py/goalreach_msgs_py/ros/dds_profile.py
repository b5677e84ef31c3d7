"""Fast DDS profiles: which machines a graph can reach, and how quickly it is discovered."""

from importlib import resources
import os
from typing import Final

_VARIABLE: Final = 'FASTRTPS_DEFAULT_PROFILES_FILE'
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


def use_profile(path: str) -> None:
    """Make a Fast DDS profile that of this process, unless the environment sets another.

    Args:
        path: Path of the profile.
    """
    os.environ.setdefault(_VARIABLE, path)


def open_to_network() -> str:
    """Open the graphs of this process to the network; return a warning for the user."""
    os.environ[_VARIABLE] = fast_dds_profile(network=True)
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    return (
        '--network: every machine that can reach this one may see the camera, drive the robot and '
        f'change parameters in ROS_DOMAIN_ID {domain}, unencrypted and without authentication'
    )
