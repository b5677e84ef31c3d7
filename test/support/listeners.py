"""Sockets of a process that accept connections or packets."""

from __future__ import annotations

from dataclasses import dataclass
import ipaddress
from pathlib import Path
import socket
import struct

import psutil


@dataclass(frozen=True, kw_only=True)
class Listener:
    """A socket that accepts connections or packets from others.

    Attributes:
        protocol: 'tcp', 'tcp6', 'udp' or 'udp6'.
        address: Local address.
        port: Local port.
        joined: Interfaces on which this machine has joined a multicast address.
    """

    protocol: str
    address: str
    port: int
    joined: tuple[str, ...] = ()

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine reaches it."""
        address = ipaddress.ip_address(self.address)
        if address.is_multicast:
            return self.joined == ('lo',)
        return address.is_loopback


def listeners_of(pid: int) -> list[Listener]:
    """Return the sockets of a process that accept connections or packets."""
    try:
        connections = psutil.Process(pid).net_connections('inet')
    except psutil.NoSuchProcess:
        return []
    joined = _joined_interfaces(pid)
    found = []
    for one in connections:
        is_tcp = one.type == socket.SOCK_STREAM
        if not one.laddr or (one.status != psutil.CONN_LISTEN if is_tcp else one.raddr):
            continue
        listener = Listener(
            protocol=('tcp' if is_tcp else 'udp') + '6' * (one.family == socket.AF_INET6),
            address=one.laddr.ip,
            port=one.laddr.port,
            joined=tuple(joined.get(one.laddr.ip, ())),
        )
        found.append(listener)
    return found


def _joined_interfaces(pid: int) -> dict[str, list[str]]:
    """Return the interfaces on which each IPv4 multicast address is joined; psutil has none."""
    found: dict[str, list[str]] = {}
    device = ''
    for line in Path(f'/proc/{pid}/net/igmp').read_text(encoding='ascii').splitlines()[1:]:
        fields = line.split()
        if not line.startswith('\t'):
            device = fields[1]
        else:
            address = socket.inet_ntoa(struct.pack('=I', int(fields[0], 16)))
            found.setdefault(address, []).append(device)
    return found
