"""Address of the live page: its socket, its URL, and how it and a launcher reach each other."""

import socket
from typing import Final

from goalreach_msgs_py.errors import GoalreachError

DEFAULT_PORT: Final = 8080
TOKEN_VARIABLE: Final = 'GOALREACH_DASHBOARD_TOKEN'  # noqa: S105 - the name of a variable
"""Environment variable that holds the token: every user can read the command lines of others."""
REQUEST: Final = 'page: '
"""Begins each line of the page's log that is for the launcher; a JSON object follows."""
_PORTS_TRIED: Final = 20
_LOOPBACK: Final = ('127.0.0.1', 'localhost', '::1')


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach an address."""
    return host in _LOOPBACK


def bind(host: str, port: int | None) -> socket.socket:
    """Return a listening socket; browsers that connect before the server runs wait for it.

    Port 0 is any free one, None the first free one from 8080.

    Raises:
        GoalreachError: The port is taken, or the address is not of this machine.
    """
    ports = [port] if port is not None else [*range(DEFAULT_PORT, DEFAULT_PORT + _PORTS_TRIED), 0]
    reason = ''
    for candidate in ports:
        is_ipv6 = ':' in host
        family = socket.AF_INET6 if is_ipv6 else socket.AF_INET
        try:
            return socket.create_server((host, candidate), family=family, dualstack_ipv6=is_ipv6)
        except (OSError, OverflowError) as error:
            reason = str(error)
    raise GoalreachError(f'{host}:{ports[0]}: cannot listen: {reason}')


def url(host: str, port: int, token: str | None = None) -> str:
    """Return the URL of the page; browsers never send its fragment, the token."""
    name = f'[{host}]' if ':' in host else host
    fragment = f'#token={token}' if token else ''
    return f'http://{name}:{port}/{fragment}'
