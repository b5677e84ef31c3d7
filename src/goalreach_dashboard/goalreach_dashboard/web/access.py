"""The gate of the web server: who may come in, from where, and what an answer must say.

Three things are asked of every request, the websocket's included. The `Host` it names must be
ours, so that a foreign name that resolves to this machine opens nothing. Its `Origin`, where the
browser tells one, must be the same; a page of another origin can neither read nor steer, and a
websocket must tell its origin. And where a token is needed, the cookie that it was exchanged for
must be there. What fails is refused before anything else sees it.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, MutableMapping
from dataclasses import dataclass
import hmac
from http.cookies import CookieError, SimpleCookie
import socket
from typing import Any, Final
from urllib.parse import parse_qsl

from goalreach_msgs_py.errors import GoalreachError

DRIVER: Final = 'goalreach.driver'
"""Key of the ASGI scope: whether the request may steer."""

LOOPBACK_NAMES: Final = ('127.0.0.1', 'localhost', '[::1]')

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

_POLICY: Final = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "connect-src 'self'; object-src 'none'; base-uri 'self'; form-action 'none'; "
    "frame-ancestors 'none'"
)
_HEADERS: Final = (
    (b'content-security-policy', _POLICY.encode()),
    (b'x-frame-options', b'DENY'),
    (b'x-content-type-options', b'nosniff'),
    (b'referrer-policy', b'no-referrer'),
)
_CLOSE: Final = 1008
_SEE_OTHER: Final = 303
_UNAUTHORIZED: Final = 401
_FORBIDDEN: Final = 403
_MISDIRECTED: Final = 421


@dataclass(frozen=True, kw_only=True)
class Door:
    """How far the page is open.

    Attributes:
        port: The port it listens at.
        hosts: Values of `Host` that are ours, or None for any (the machine's names are many).
        token: What must be shown, or None.
        token_to_read: Whether it must be shown even to look.
        steers: Whether who shows it may steer.
    """

    port: int
    hosts: frozenset[str] | None
    token: str | None
    token_to_read: bool
    steers: bool

    @classmethod
    def loopback(cls, port: int, *, token: str | None) -> Door:
        """Return the door of a page for this machine; who has the token, if any, may steer."""
        hosts = frozenset(f'{name}:{port}' for name in LOOPBACK_NAMES)
        return cls(
            port=port, hosts=hosts, token=token, token_to_read=False, steers=token is not None
        )

    @classmethod
    def network(cls, port: int, *, token: str) -> Door:
        """Return the door of a page for other machines: to look at, with a token."""
        return cls(port=port, hosts=None, token=token, token_to_read=True, steers=False)

    @property
    def cookie(self) -> str:
        """Name of the cookie; cookies know no ports, so its name does."""
        return f'goalreach-{self.port}'

    def knows(self, shown: str | None) -> bool:
        """Return whether the token was shown."""
        if self.token is None or shown is None:
            return False
        return hmac.compare_digest(shown.encode(), self.token.encode())


class Guard:
    """An ASGI application in front of another.

    Args:
        app: What is guarded.
        door: How far it is open.
    """

    def __init__(self, app: App, door: Door) -> None:
        self._app = app
        self._door = door

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, send it on, or refuse it."""
        if scope['type'] == 'lifespan':
            await self._app(scope, receive, send)
            return
        headers = _headers(scope)
        refusal = self._refusal(scope, headers)
        if refusal is not None:
            await _refuse(scope, send, *refusal)
            return
        query = dict(parse_qsl(scope.get('query_string', b'').decode('latin-1')))
        if scope['type'] == 'http' and 'token' in query:
            await self._exchange(scope, send, query['token'])
            return
        known = self._door.knows(_cookie(headers, self._door.cookie))
        if self._door.token_to_read and not known:
            await _refuse(scope, send, _UNAUTHORIZED, 'open the link with the token')
            return
        scope[DRIVER] = known and self._door.steers
        await self._app(scope, receive, _with_headers(send))

    def _refusal(self, scope: Scope, headers: dict[bytes, str]) -> tuple[int, str] | None:
        host, origin = headers.get(b'host', ''), headers.get(b'origin')
        if self._door.hosts is not None and host.lower() not in self._door.hosts:
            return _MISDIRECTED, 'not the name of this page'
        if scope['type'] == 'websocket' and origin is None:
            return _FORBIDDEN, 'a websocket must tell its origin'
        if origin is not None and origin.lower() != f'http://{host.lower()}':
            return _FORBIDDEN, 'another origin'
        site = headers.get(b'sec-fetch-site', 'none')
        visit = headers.get(b'sec-fetch-mode') == 'navigate' and scope.get('method') == 'GET'
        if site not in ('none', 'same-origin') and not visit:
            return _FORBIDDEN, 'another site'
        return None

    async def _exchange(self, scope: Scope, send: Send, shown: str) -> None:
        """Turn the token of a link into a cookie, so that it leaves the address bar."""
        if not self._door.knows(shown):
            await _refuse(scope, send, _FORBIDDEN, 'wrong token')
            return
        cookie = f'{self._door.cookie}={self._door.token}; Path=/; HttpOnly; SameSite=Lax'
        headers = [(b'location', b'/'), (b'set-cookie', cookie.encode()), *_HEADERS]
        await send({'type': 'http.response.start', 'status': _SEE_OTHER, 'headers': headers})
        await send({'type': 'http.response.body', 'body': b''})


def _headers(scope: Scope) -> dict[bytes, str]:
    return {name.lower(): value.decode('latin-1') for name, value in scope['headers']}


def _cookie(headers: dict[bytes, str], name: str) -> str | None:
    try:
        morsel = SimpleCookie(headers.get(b'cookie', '')).get(name)
    except CookieError:
        return None
    return None if morsel is None else morsel.value


async def _refuse(scope: Scope, send: Send, status: int, reason: str) -> None:
    if scope['type'] == 'websocket':
        await send({'type': 'websocket.close', 'code': _CLOSE, 'reason': reason})
        return
    headers = [(b'content-type', b'text/plain; charset=utf-8'), *_HEADERS]
    await send({'type': 'http.response.start', 'status': status, 'headers': headers})
    await send({'type': 'http.response.body', 'body': f'{reason}\n'.encode()})


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message['type'] == 'http.response.start':
            message['headers'] = [*message.get('headers', []), *_HEADERS]
        await send(message)

    return sending


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
