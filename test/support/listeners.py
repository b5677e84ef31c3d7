"""Sockets of a process that accept connections or packets."""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from dataclasses import dataclass
import errno
import ipaddress
import os
import socket
import struct
from typing import Any, Final

import psutil

_LIBC: Final = ctypes.CDLL(None, use_errno=True)
_PIDFD_GETFD: Final = 438  # on every architecture: include/uapi/asm-generic/unistd.h of Linux
_MCAST_MSFILTER: Final = 48  # include/uapi/linux/in.h
_FILTER_BYTES: Final = 136  # mode, number of sources, room for one source


@dataclass(frozen=True, kw_only=True)
class Listener:
    """A socket that accepts connections or packets from others.

    Attributes:
        protocol: 'tcp', 'tcp6', 'udp' or 'udp6'.
        address: Local address.
        port: Local port.
        joined: Interfaces on which it has joined its multicast address.
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
    found = []
    for one in connections:
        is_tcp = one.type == socket.SOCK_STREAM
        if not one.laddr or (one.status != psutil.CONN_LISTEN if is_tcp else one.raddr):
            continue
        multicast = ipaddress.ip_address(one.laddr.ip).is_multicast
        listener = Listener(
            protocol=('tcp' if is_tcp else 'udp') + '6' * (one.family == socket.AF_INET6),
            address=one.laddr.ip,
            port=one.laddr.port,
            joined=_joined(pid, one.fd, one.laddr.ip) if multicast else (),
        )
        found.append(listener)
    return found


def _joined(pid: int, descriptor: int, address: str) -> tuple[str, ...]:
    """Return the interfaces on which a socket of a process joined an IPv4 multicast address.

    /proc/net/igmp says it of all processes of the machine together.
    """
    process = os.pidfd_open(pid)
    try:
        own = _call(_LIBC.syscall, _PIDFD_GETFD, process, descriptor, 0)
    finally:
        os.close(process)
    with socket.socket(fileno=own):
        group = struct.pack('=HH4s120x', socket.AF_INET, 0, socket.inet_aton(address))
        return tuple(
            name
            for index, name in socket.if_nameindex()
            if _is_member(own, struct.pack('@I4x', index) + group)
        )


def _is_member(descriptor: int, request: bytes) -> bool:
    """Ask for the filter of a group on an interface, which only a member has: `man 7 ip`."""
    buffer = ctypes.create_string_buffer(request, len(request) + _FILTER_BYTES)
    size = ctypes.c_uint(len(buffer))
    try:
        _call(
            _LIBC.getsockopt,
            descriptor,
            socket.IPPROTO_IP,
            _MCAST_MSFILTER,
            buffer,
            ctypes.byref(size),
        )
    except OSError as error:
        if error.errno == errno.EADDRNOTAVAIL:
            return False
        raise
    return True


def _call(function: Callable[..., int], *arguments: Any) -> int:  # noqa: ANN401 - of a C function
    result = function(*arguments)
    if result < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result
