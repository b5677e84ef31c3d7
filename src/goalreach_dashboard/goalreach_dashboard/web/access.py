"""Access control of the web server: which requests are served, and what every response forbids.

Three checks apply to every request, websockets included:

* `Host` must be a name of this page, so that a foreign name resolving to this machine opens
  nothing (DNS rebinding).
* `Origin`, where the browser sends one, must match; pages of other origins can neither read nor
  steer. A websocket must send its origin.
* Where a token is required, the cookie it was exchanged for must be present.

Requests that fail are refused before NiceGUI sees them.
"""

from dataclasses import dataclass
import hmac
from typing import Final

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MAY_STEER: Final = 'goalreach.may_steer'
"""Key of the ASGI scope: whether the request may steer the robot."""

_LOOPBACK_NAMES: Final = ('127.0.0.1', 'localhost', '[::1]')
_CONTENT_POLICY: Final = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "connect-src 'self'; object-src 'none'; base-uri 'self'; form-action 'none'; "
    "frame-ancestors 'none'"
)
_HEADERS: Final = {
    'content-security-policy': _CONTENT_POLICY,
    'x-frame-options': 'DENY',
    'x-content-type-options': 'nosniff',
    'referrer-policy': 'no-referrer',
}
_SEE_OTHER: Final = 303
_UNAUTHORIZED: Final = 401
_FORBIDDEN: Final = 403
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

    @property
    def cookie(self) -> str:
        """Name of the cookie; it holds the port because browsers share cookies between ports."""
        return f'goalreach-{self.port}'

    def accepts_host(self, host: str) -> bool:
        """Return whether a `Host` names this page; other machines may use any name."""
        return not self.local or host in [f'{name}:{self.port}' for name in _LOOPBACK_NAMES]

    def accepts_token(self, token: str | None) -> bool:
        """Return whether a token is the right one."""
        if self.token is None or token is None:
            return False
        return hmac.compare_digest(token.encode(), self.token.encode())


class AccessMiddleware:
    """ASGI middleware that enforces an access policy.

    Args:
        app: The protected application.
        policy: The policy.
    """

    def __init__(self, app: ASGIApp, policy: AccessPolicy) -> None:
        self._app = app
        self._policy = policy

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request, exchange its token for a cookie, or refuse it."""
        if scope['type'] == 'lifespan':
            await self._app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        response = self._response(connection)
        if response is not None:
            response.headers.update(_HEADERS)
            await response(scope, receive, send)
            return
        scope[MAY_STEER] = self._policy.local and self._has_cookie(connection)

        async def send_with_headers(message: Message) -> None:
            if message['type'] == 'http.response.start':
                MutableHeaders(scope=message).update(_HEADERS)
            await send(message)

        await self._app(scope, receive, send_with_headers)

    def _response(self, connection: HTTPConnection) -> Response | None:
        """Return a refusal or a redirection; None where the application is to respond."""
        refusal = self._foreign(connection)
        if refusal is not None:
            return refusal
        token = connection.query_params.get('token')
        if token is not None and connection.scope['type'] == 'http':
            return self._exchange(token)
        if not self._policy.local and not self._has_cookie(connection):
            return PlainTextResponse('open the URL with the token\n', _UNAUTHORIZED)
        return None

    def _has_cookie(self, connection: HTTPConnection) -> bool:
        return self._policy.accepts_token(connection.cookies.get(self._policy.cookie))

    def _foreign(self, connection: HTTPConnection) -> Response | None:
        headers, scope = connection.headers, connection.scope
        host, origin = headers.get('host', '').lower(), headers.get('origin')
        if not self._policy.accepts_host(host):
            return PlainTextResponse('wrong host name\n', _MISDIRECTED)
        if scope['type'] == 'websocket' and origin is None:
            return PlainTextResponse('websocket without origin\n', _FORBIDDEN)
        if origin is not None and origin.lower() != f'http://{host}':
            return PlainTextResponse('wrong origin\n', _FORBIDDEN)
        link = headers.get('sec-fetch-mode') == 'navigate' and scope.get('method') == 'GET'
        if headers.get('sec-fetch-site', 'none') not in ('none', 'same-origin') and not link:
            return PlainTextResponse('request of another site\n', _FORBIDDEN)
        return None

    def _exchange(self, token: str) -> Response:
        """Move the token of a URL into a cookie, so that it leaves the address bar."""
        if not self._policy.accepts_token(token):
            return PlainTextResponse('wrong token\n', _FORBIDDEN)
        response = RedirectResponse('/', _SEE_OTHER)
        response.set_cookie(self._policy.cookie, token, httponly=True, samesite='lax')
        return response
