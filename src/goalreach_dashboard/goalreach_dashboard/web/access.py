"""Access control of the web server: which requests are served, and what every response forbids.

Three checks apply to every request, websockets included:

* `Host` must be a name of this page, so that a foreign name resolving to this machine opens
  nothing (DNS rebinding).
* `Origin`, where the browser sends one, must match; pages of other origins can neither read nor
  steer. A websocket must send its origin.
* Where a token is required, the cookie it was exchanged for must be present.

Requests that fail are refused before NiceGUI sees them.
"""

from __future__ import annotations

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

    Attributes:
        port: Port of the server.
        hosts: Accepted values of `Host`; None for any, since a machine has many names.
        token: The secret of the printed URL, or None.
        token_to_view: Whether viewing needs the token.
        token_steers: Whether the token allows steering.
    """

    port: int
    hosts: frozenset[str] | None
    token: str | None
    token_to_view: bool
    token_steers: bool

    @classmethod
    def loopback(cls, port: int, *, token: str | None) -> AccessPolicy:
        """Return the policy of a page for this machine: anyone views, the token steers."""
        return cls(
            port=port,
            hosts=frozenset(f'{name}:{port}' for name in _LOOPBACK_NAMES),
            token=token,
            token_to_view=False,
            token_steers=token is not None,
        )

    @classmethod
    def network(cls, port: int, *, token: str) -> AccessPolicy:
        """Return the policy of a page for other machines: the token views, nobody steers."""
        return cls(port=port, hosts=None, token=token, token_to_view=True, token_steers=False)

    @property
    def cookie(self) -> str:
        """Name of the cookie; it holds the port because browsers share cookies between ports."""
        return f'goalreach-{self.port}'

    def accepts(self, token: str | None) -> bool:
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
        known = self._policy.accepts(connection.cookies.get(self._policy.cookie))
        scope[MAY_STEER] = known and self._policy.token_steers

        async def send_with_headers(message: Message) -> None:
            if message['type'] == 'http.response.start':
                MutableHeaders(scope=message).update(_HEADERS)
            await send(message)

        await self._app(scope, receive, send_with_headers)

    def _response(self, connection: HTTPConnection) -> Response | None:
        """Return a refusal or a redirection; None where the application is to respond."""
        policy = self._policy
        refusal = self._foreign(connection)
        if refusal is not None:
            return refusal
        token = connection.query_params.get('token')
        if token is not None and connection.scope['type'] == 'http':
            return self._exchange(token)
        if policy.token_to_view and not policy.accepts(connection.cookies.get(policy.cookie)):
            return PlainTextResponse('open the URL with the token\n', _UNAUTHORIZED)
        return None

    def _foreign(self, connection: HTTPConnection) -> Response | None:
        headers, scope = connection.headers, connection.scope
        host, origin = headers.get('host', '').lower(), headers.get('origin')
        if self._policy.hosts is not None and host not in self._policy.hosts:
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
        if not self._policy.accepts(token):
            return PlainTextResponse('wrong token\n', _FORBIDDEN)
        response = RedirectResponse('/', _SEE_OTHER)
        response.set_cookie(self._policy.cookie, token, httponly=True, samesite='lax')
        return response
