"""Access control, called as a server calls it."""

from __future__ import annotations

import asyncio
from collections.abc import MutableMapping
from dataclasses import replace
from typing import Any

import pytest
from starlette.types import Message, Receive, Scope, Send

from goalreach_dashboard.web.access import AccessMiddleware, AccessPolicy

LOCAL = AccessPolicy(port=8080, token=None, local=True)
STEERED = AccessPolicy(port=8080, token='secret', local=True)  # noqa: S106 - a test's
NETWORK = AccessPolicy(port=8080, token='secret', local=False)  # noqa: S106 - a test's
OURS = {'host': '127.0.0.1:8080'}


class Answer:
    """What a request got.

    Attributes:
        status: HTTP status.
        headers: Headers of the answer.
        passed: The scope that the application saw, or None.
    """

    def __init__(self) -> None:
        self.status = -1
        self.headers: dict[str, str] = {}
        self.passed: MutableMapping[str, Any] | None = None


def request(policy: AccessPolicy, headers: dict[str, str], *, kind: str = 'http') -> Answer:
    answer = Answer()

    async def app(scope: Scope, _receive: Receive, send: Send) -> None:
        answer.passed = scope
        if scope['type'] == 'http':
            await send({'type': 'http.response.start', 'status': 200, 'headers': []})

    async def send(message: Message) -> None:
        if message['type'].endswith('http.response.start'):
            answer.status = message['status']
            answer.headers = {k.decode(): v.decode() for k, v in message['headers']}

    async def receive() -> Message:
        return {}

    scope: Scope = {
        'type': kind,
        'method': 'GET',
        'path': '/',
        'query_string': b'',
        'headers': [(k.encode(), v.encode()) for k, v in headers.items()],
    }
    asyncio.run(AccessMiddleware(app, policy)(scope, receive, send))
    return answer


def test_our_own_page_is_served_and_may_load_nothing_else() -> None:
    answer = request(LOCAL, OURS)
    assert answer.status == 200
    assert answer.passed is not None
    assert "default-src 'none'" in answer.headers['content-security-policy']
    assert answer.headers['x-frame-options'] == 'DENY'


@pytest.mark.parametrize('kind', ['http', 'websocket'])
@pytest.mark.parametrize(
    'headers',
    [
        {},
        {'host': 'elsewhere.example:8080', 'origin': 'http://elsewhere.example:8080'},
        {'host': '127.0.0.1:9999', 'origin': 'http://127.0.0.1:9999'},
        {**OURS, 'origin': 'http://elsewhere.example'},
        {**OURS, 'origin': 'https://127.0.0.1:8080'},
        {**OURS, 'origin': 'null'},
        {**OURS, 'sec-fetch-site': 'cross-site', 'sec-fetch-mode': 'no-cors'},
    ],
)
def test_others_are_refused(kind: str, headers: dict[str, str]) -> None:
    answer = request(LOCAL, headers, kind=kind)
    assert answer.passed is None
    assert answer.status in (403, 421)


def test_a_websocket_must_send_its_origin() -> None:
    assert request(LOCAL, OURS, kind='websocket').passed is None
    ours = {**OURS, 'origin': 'http://127.0.0.1:8080'}
    assert request(LOCAL, ours, kind='websocket').passed is not None


def test_a_link_on_another_page_may_lead_here() -> None:
    visit = {**OURS, 'sec-fetch-site': 'cross-site', 'sec-fetch-mode': 'navigate'}
    assert request(LOCAL, visit).status == 200


def test_only_the_holder_of_the_token_steers() -> None:
    assert STEERED.may_steer('secret')
    for token in (None, '', 'wrong', 3, ['secret'], 'sécret'):
        assert not STEERED.may_steer(token)
        assert STEERED.may_view(token)
    assert not LOCAL.may_steer(None)
    assert not LOCAL.may_steer('None')


def test_from_another_machine_the_token_is_needed_and_does_not_steer() -> None:
    assert NETWORK.may_view('secret')
    assert not NETWORK.may_steer('secret')
    assert not NETWORK.may_view(None)
    origin = {'host': 'robot.example:8080', 'origin': 'http://elsewhere.example:8080'}
    assert request(NETWORK, origin, kind='websocket').passed is None


def test_no_cookie_is_set_and_none_is_needed() -> None:
    answer = request(STEERED, OURS)
    assert 'set-cookie' not in answer.headers


def test_the_policy_allows_no_inline_code_and_no_eval() -> None:
    policy = request(LOCAL, OURS).headers['content-security-policy']
    assert 'unsafe' not in policy
    assert "script-src 'self';" in policy


def test_the_port_that_browsers_leave_out() -> None:
    policy = replace(LOCAL, port=80)
    assert request(policy, {'host': 'localhost'}).status == 200
    assert request(LOCAL, {'host': 'localhost'}).status == 421
