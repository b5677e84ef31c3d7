"""Access control of the web server: which requests are served, and what every response forbids.

Two checks apply to every request, websockets included:

* `Host` must be a name of this page, so that a foreign name resolving to this machine opens
  nothing (DNS rebinding).
* `Origin`, where the browser sends one, must match; pages of other origins can neither read nor
  steer. A websocket must send its origin.

Requests that fail are refused before the application sees them. The token is not checked here: it
travels in the fragment of the printed URL, which browsers do not send, and then in the first
message of the websocket. A cookie would reach every port of this machine.
"""

from dataclasses import dataclass
import hmac
from typing import Final

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_LOOPBACK_NAMES: Final = ('127.0.0.1', 'localhost', '[::1]')
_CONTENT_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS: Final = {
    'content-security-policy': _CONTENT_POLICY,
    'cross-origin-opener-policy': 'same-origin',
    'cross-origin-resource-policy': 'same-origin',
    'x-frame-options': 'DENY',
    'x-content-type-options': 'nosniff',
    'referrer-policy': 'no-referrer',
    'cache-control': 'no-cache',
}
_FORBIDDEN: Final = 403
_HTTP_PORT: Final = 80
"""Browsers leave it out of the host name."""
_MISDIRECTED: Final = 421


@dataclass(frozen=True, kw_only=True)
class AccessPolicy:
    """Who may view the page and who may steer.

    A local page is viewed by anyone on this machine and steered by holders of the token; a page
    for other machines is viewed by holders of the token and steered by nobody.

    Attributes:
        port: Port of the server.
        token: The secret of the printed URL, or None.
        local: Whether only this machine can reach the page.
    """

    port: int
    token: str | None
    local: bool

    def may_view(self, token: object) -> bool:
        """Return whether the holder of a token, or of none, may see the graph."""
        return self.local or self._accepts(token)

    def may_steer(self, token: object) -> bool:
        """Return whether the holder of a token may steer."""
        return self.local and self._accepts(token)

    def _accepts(self, token: object) -> bool:
        if self.token is None or not isinstance(token, str):
            return False
        return hmac.compare_digest(token.encode(), self.token.encode())


class AccessMiddleware:
    """ASGI middleware that refuses requests of other names and origins."""

    def __init__(self, app: ASGIApp, policy: AccessPolicy) -> None:
        self._app = app
        self._policy = policy

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request or refuse it."""
        if scope['type'] == 'lifespan':
            await self._app(scope, receive, send)
            return
        refusal = self._refusal(HTTPConnection(scope))
        if refusal is not None:
            refusal.headers.update(_HEADERS)
            await refusal(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message['type'] == 'http.response.start':
                MutableHeaders(scope=message).update(_HEADERS)
            await send(message)

        await self._app(scope, receive, send_with_headers)

    def _refusal(self, connection: HTTPConnection) -> Response | None:
        """Return the response to a foreign request; None where the application is to respond."""
        headers, scope = connection.headers, connection.scope
        host, origin = headers.get('host', '').lower(), headers.get('origin')
        port = self._policy.port
        names = [f'{name}:{port}' for name in _LOOPBACK_NAMES]
        names += _LOOPBACK_NAMES if port == _HTTP_PORT else ()
        if self._policy.local and host not in names:  # other machines may use any name
            return PlainTextResponse('wrong host name\n', _MISDIRECTED)
        if scope['type'] == 'websocket' and origin is None:
            return PlainTextResponse('websocket without origin\n', _FORBIDDEN)
        if origin is not None and origin.lower() != f'http://{host}':
            return PlainTextResponse('wrong origin\n', _FORBIDDEN)
        link = headers.get('sec-fetch-mode') == 'navigate' and scope.get('method') == 'GET'
        if headers.get('sec-fetch-site', 'none') not in ('none', 'same-origin') and not link:
            return PlainTextResponse('request of another site\n', _FORBIDDEN)
        return None
