"""What Linux tells of processes: who belongs to a stack, what they hold, where they listen."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
import ipaddress
import os
from pathlib import Path
import re
import struct

from goalreach_msgs_py.topics import NODES

_TCP_LISTEN = '0A'
_UDP_UNCONNECTED = '07'
_MB = 1e6
_NAME_LENGTH = 15
"""Linux keeps so many letters of the name of a process."""


@dataclass(frozen=True, kw_only=True)
class Holdings:
    """What a process holds.

    Attributes:
        name: Which of ours it is.
        memory_mb: Resident memory of its own, without shared memory.
        threads: Number of threads.
        handles: Number of open files, sockets and pipes.
        shared_files: Number of files in shared memory that it has mapped.
    """

    name: str
    memory_mb: float
    threads: int
    handles: int
    shared_files: int


@dataclass(frozen=True, kw_only=True)
class Listener:
    """A socket on which something can come in.

    Attributes:
        protocol: 'tcp', 'tcp6', 'udp' or 'udp6'.
        address: Local address.
        port: Local port.
        joined: Interfaces on which this machine takes part in a multicast address.
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


def children_of(pid: int) -> list[int]:
    """Return the process ids of the children of a process."""
    try:
        text = Path(f'/proc/{pid}/task/{pid}/children').read_text(encoding='ascii')
    except OSError:
        return []
    return [int(word) for word in text.split()]


def find_child(pid: int, node: str) -> int | None:
    """Return the child of a launcher that is a node, or None where there is none now."""
    return next((child for child in children_of(pid) if _comm(child) == node[:_NAME_LENGTH]), None)


def _comm(pid: int) -> str:
    return _read(pid, 'comm').decode(errors='replace').strip()


def descendants_of(pid: int) -> list[int]:
    """Return the process ids of the children of a process, of theirs, and so on."""
    parents = {one: int(fields[1]) for one in _all() if (fields := _stat(one))}
    found, new = [], {pid}
    while new:
        new = {one for one, parent in parents.items() if parent in new}
        found += sorted(new)
    return found


def processor_s(pid: int) -> float:
    """Return the processor time that a process has used, s; 0 where it has ended."""
    fields = _stat(pid)
    return sum(map(int, fields[11:13])) / os.sysconf('SC_CLK_TCK') if fields else 0.0


def _stat(pid: int) -> list[str]:
    """Return the fields of /proc/PID/stat from the third, the state, on."""
    return _read(pid, 'stat').decode(errors='replace').rpartition(')')[2].split()


def processes_with(variable: str, value: str) -> list[int]:
    """Return the processes that were started with a variable of the environment at a value."""
    wanted = f'{variable}={value}'.encode()
    return [pid for pid in _all() if wanted in _read(pid, 'environ').split(b'\0')]


def _all() -> Iterator[int]:
    for path in Path('/proc').iterdir():
        if path.name.isdigit():
            yield int(path.name)


def _read(pid: int, name: str) -> bytes:
    try:
        return Path(f'/proc/{pid}/{name}').read_bytes()
    except OSError:
        return b''


def holdings_of(pid: int) -> Holdings | None:
    """Return what a process holds, or None where it has ended."""
    status = dict(re.findall(r'^(\w+):\s+(\d+)', _read(pid, 'status').decode(), re.MULTILINE))
    try:
        handles = sum(1 for _ in Path(f'/proc/{pid}/fd').iterdir())
    except OSError:
        return None
    if 'RssAnon' not in status:
        return None
    return Holdings(
        name=_name(_comm(pid), _read(pid, 'cmdline').decode(errors='replace').split('\0')),
        memory_mb=int(status['RssAnon']) * 1024 / _MB,
        threads=int(status['Threads']),
        handles=handles,
        shared_files=len(set(re.findall(rb'/dev/shm/\S+', _read(pid, 'maps')))),
    )


def _name(comm: str, words: list[str]) -> str:
    """Return the node or the spare that a process calls itself, else the command that it is."""
    for name in (*NODES, 'composed', 'spare'):
        if comm == name[:_NAME_LENGTH]:
            return name
    commands = [word for word in words if word in {'record', 'dashboard'}]
    return commands[0] if commands else 'launcher'


def listeners_of(pid: int) -> list[Listener]:
    """Return the sockets of a process on which something can come in."""
    inodes = set()
    for path in Path(f'/proc/{pid}/fd').glob('*'):
        try:
            found = re.fullmatch(r'socket:\[(\d+)\]', str(path.readlink()))
        except OSError:
            continue
        if found:
            inodes.add(found[1])
    return [
        listener
        for protocol in ('tcp', 'tcp6', 'udp', 'udp6')
        for inode, listener in _sockets(pid, protocol)
        if inode in inodes
    ]


def _sockets(pid: int, protocol: str) -> Iterator[tuple[str, Listener]]:
    """Yield inode and address of the sockets of a protocol that wait for others."""
    joined = _joined(pid)
    waiting = _TCP_LISTEN if protocol.startswith('tcp') else _UDP_UNCONNECTED
    for line in _read(pid, f'net/{protocol}').decode().splitlines()[1:]:
        fields = line.split()
        if fields[3] == waiting:
            text, _, port = fields[1].partition(':')
            address = _address(text)
            interfaces = tuple(joined.get(address, ()))
            yield (
                fields[9],
                Listener(
                    protocol=protocol, address=address, port=int(port, 16), joined=interfaces
                ),
            )


def _joined(pid: int) -> dict[str, list[str]]:
    """Return the interfaces on which each multicast address is listened to."""
    found: dict[str, list[str]] = {}
    device = ''
    for line in _read(pid, 'net/igmp').decode().splitlines()[1:]:
        fields = line.split()
        if not line.startswith('\t'):
            device = fields[1]
        else:
            found.setdefault(_address(fields[0]), []).append(device)
    return found


def _address(text: str) -> str:
    """Return an address of /proc/net: hexadecimal words, each in the order of the machine."""
    words = [int(text[i : i + 8], 16) for i in range(0, len(text), 8)]
    packed = b''.join(struct.pack('=I', word) for word in words)
    return str(ipaddress.ip_address(packed))
