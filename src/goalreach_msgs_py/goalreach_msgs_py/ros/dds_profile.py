"""Fast DDS profiles: which machines a graph can reach, and how quickly it is discovered."""

from __future__ import annotations

from importlib import resources
import os
from typing import Final

_PROFILE = 'fastdds.xml'


_NETWORK_PROFILE = 'fastdds_network.xml'


DISCOVERY_PROFILE: Final = str(
    resources.files('goalreach_msgs_py') / 'config' / 'fastdds_discovery.xml'
)
"""Profile of short-lived participants, such as the `ros2` commands and the recorder."""


def fast_dds_profile(*, network: bool = False) -> str:
    """Return the path of the Fast DDS profile of the graph.

    Args:
        network: Whether other machines may take part; else it is private to this one.
    """
    name = _NETWORK_PROFILE if network else _PROFILE
    return str(resources.files('goalreach_msgs_py') / 'config' / name)


def open_to_network() -> str:
    """Open the graphs of this process to the network; return the line that tells what it means."""
    os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'] = fast_dds_profile(network=True)
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    return (
        f'--network: every machine that reaches this one can see the camera, drive the robot and '
        f'change parameters in ROS_DOMAIN_ID {domain}; nothing is encrypted and nobody is asked '
        'who he is'
    )
