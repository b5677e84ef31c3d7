"""Where the page listens."""

from __future__ import annotations

import socket
from typing import Final

from goalreach_msgs_py.errors import GoalreachError

__all__ = ['DEFAULT_PORT', 'TOKEN_VARIABLE', 'bind', 'is_loopback', 'url']

DEFAULT_PORT: Final = 8080
TOKEN_VARIABLE: Final = 'GOALREACH_DASHBOARD_TOKEN'  # noqa: S105 - the name of a variable
"""Environment variable that holds the token: command lines are for everyone to read."""
_TRIES: Final = 20
_LOOPBACK: Final = ('127.0.0.1', 'localhost', '::1')


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach an address."""
    return host in _LOOPBACK


def bind(host: str, port: int | None) -> socket.socket:
    """Return a socket that listens: who opens the page at once waits, and is not refused.

    Args:
        host: Address of this machine.
        port: Port; 0 for any that is free; None for the first free one from 8080.

    Raises:
        GoalreachError: It is taken, or the address is not of this machine.
    """
    ports = [port] if port is not None else [*range(DEFAULT_PORT, DEFAULT_PORT + _TRIES), 0]
    reason = ''
    for candidate in ports:
        family = socket.AF_INET6 if ':' in host else socket.AF_INET
        listener = socket.socket(family, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((host, candidate))
            listener.listen()  # only then is the port ours alone
        except (OSError, OverflowError) as error:
            listener.close()
            reason = str(error)
        else:
            return listener
    raise GoalreachError(f'{host}:{port or DEFAULT_PORT}: cannot listen: {reason}')


def url(host: str, port: int, token: str | None = None) -> str:
    """Return the address of the page, as a person types it."""
    name = f'[{host}]' if ':' in host else host
    shown = f'/?token={token}' if token else '/'
    return f'http://{name}:{port}{shown}'
