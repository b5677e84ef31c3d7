"""Number of DDS participants on this machine, from the ports that they listen on.

A lost announcement is repeated only seconds later: a tool that lists the graph must know that it
has not seen all of it yet.
"""

from pathlib import Path
from typing import Final

SOCKETS: Final = Path('/proc/net/udp')
"""Linux's table of the UDP sockets of this network namespace."""

# DDSI-RTPS 2.2, section 9.6.1.1: a participant listens for discovery on port
# PB + DG * domain + d1 + PG * participant.
_PORT_BASE: Final = 7400
_DOMAIN_GAIN: Final = 250
_PARTICIPANT_GAIN: Final = 2
_UNICAST_OFFSET: Final = 10


def domain_ports(domain: int) -> range:
    """Return the UDP ports of a domain.

    Args:
        domain: The `ROS_DOMAIN_ID`.
    """
    first = _PORT_BASE + _DOMAIN_GAIN * domain
    return range(first, first + _DOMAIN_GAIN)


def count_local_participants(domain: int, sockets: Path = SOCKETS) -> int:
    """Return how many participants of a domain listen on this machine.

    Args:
        domain: The `ROS_DOMAIN_ID`.
        sockets: The table of sockets.

    Returns:
        Their number; 0 where the system has no such table.
    """
    ports = domain_ports(domain)[_UNICAST_OFFSET::_PARTICIPANT_GAIN]
    try:
        lines = sockets.read_text(encoding='ascii').splitlines()[1:]
    except OSError:
        return 0
    bound = {int(line.split()[1].rpartition(':')[2], 16) for line in lines}
    return len(bound.intersection(ports))
