"""Fast DDS: its profiles, and the number of participants on this machine.

A profile says which machines a graph can reach, and how quickly it is discovered. A lost
announcement is repeated only seconds later: a tool that lists the graph must know that it has not
seen all of it yet.
"""

from collections.abc import Mapping
from importlib import resources
import os
from pathlib import Path
from typing import Final

from goalreach_msgs_py.ros.distribution import JAZZY, KILTED, installed

PROFILE_VARIABLE: Final = installed().profile_variable
_CONFIG: Final = resources.files('goalreach_msgs_py') / 'config'

DISCOVERY_PROFILE: Final = str(_CONFIG / 'fastdds_discovery.xml')
"""Profile of short-lived participants, such as the `ros2` commands and the recorder. It announces
them often: of 20 commands each, the slowest found a default node after 2.5 s without it and after
0.5 s with it."""

# DDSI-RTPS 2.2, section 9.6.1.1: a participant listens for discovery on port
# PB + DG * domain + d1 + PG * participant.
_PORT_BASE: Final = 7400
_DOMAIN_GAIN: Final = 250
_PARTICIPANT_GAIN: Final = 2
_UNICAST_OFFSET: Final = 10


def fast_dds_profile(*, network: bool = False) -> str:
    """Return the path of the Fast DDS profile of the graph.

    The graph is private to this machine unless others may take part, over the network.
    """
    return str(_CONFIG / f'fastdds{"_network" if network else ""}{installed().profile_suffix}.xml')


def chosen_profile(environment: Mapping[str, str], default: str) -> str:
    """Return the path of the Fast DDS profile that the environment names, else the default."""
    given = (environment.get(each.profile_variable) for each in (JAZZY, KILTED))
    return next(filter(None, given), default)


def use_profile(path: str) -> None:
    """Make a Fast DDS profile that of this process, unless the environment sets another."""
    os.environ[PROFILE_VARIABLE] = chosen_profile(os.environ, path)


def open_to_network() -> str:
    """Open the graphs of this process to the network; return a warning for the user."""
    os.environ[PROFILE_VARIABLE] = fast_dds_profile(network=True)
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    return (
        '--network: every machine that can reach this one may see the camera, drive the robot and '
        f'change parameters in ROS_DOMAIN_ID {domain}, unencrypted and without authentication'
    )


def domain_ports(domain: int) -> range:
    """Return the UDP ports of a `ROS_DOMAIN_ID`."""
    first = _PORT_BASE + _DOMAIN_GAIN * domain
    return range(first, first + _DOMAIN_GAIN)


def count_local_participants(domain: int, sockets: Path = Path('/proc/net/udp')) -> int:
    """Return how many participants of a `ROS_DOMAIN_ID` listen on this machine.

    The default is Linux's table of the UDP sockets of this network namespace; it is 0 without.
    """
    ports = domain_ports(domain)[_UNICAST_OFFSET::_PARTICIPANT_GAIN]
    try:
        lines = sockets.read_text(encoding='ascii').splitlines()[1:]
    except OSError:
        return 0
    bound = {int(line.split()[1].rpartition(':')[2], 16) for line in lines}
    return len(bound.intersection(ports))
