"""Clients of the dashboard that paint nothing: they take each frame and ask for the next.

A browser without a graphics card spends most of its processor time on painting. These clients
speak the same protocol and need hardly any processor time, so that the cost of the page can be
measured apart from that of browsers on the same machine.
"""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
import re
import threading
from typing import Any, Final
from urllib.parse import urlencode, urlsplit
import uuid

from goalreach_msgs_py.errors import GoalreachError

_CLIENT: Final = re.compile(r"'client_id': '([^']+)'")
_LIVE: Final = re.compile(r'"(\d+)":\{"tag":"nicegui-live"')
_NEXT: Final = re.compile(r'"listener_id":"([^"]+)","type":"next"')
_SOCKET: Final = '_nicegui_ws/socket.io'
_UP_S: Final = 30.0


class DashboardClient:
    """One client of a page.

    Attributes:
        frames: Updates received so far.
    """

    def __init__(self) -> None:
        """Prepare; nothing is opened yet."""
        import socketio

        self.frames = 0
        self._socket = socketio.AsyncClient(reconnection=False)
        self._event: dict[str, Any] = {}

    async def open(self, url: str) -> None:
        """Load the page and connect to it.

        Raises:
            GoalreachError: It is not a live page.
        """
        import aiohttp

        async with aiohttp.ClientSession() as session, session.get(url) as answer:
            text = await answer.text()
        found = [pattern.search(text) for pattern in (_CLIENT, _LIVE, _NEXT)]
        client, live, listener = (match[1] if match else '' for match in found)
        if not (client and live and listener):
            raise GoalreachError(f'{url}: is not a live page')
        self._event = {'id': int(live), 'client_id': client, 'listener_id': listener}
        self._socket.on('run_javascript', self._on_script)
        query = {
            'client_id': client,
            'next_message_id': 0,
            'implicit_handshake': 'true',
            'tab_id': str(uuid.uuid4()),
            'document_id': str(uuid.uuid4()),
        }
        parts = urlsplit(url)
        origin = f'{parts.scheme}://{parts.netloc}'
        await self._socket.connect(
            f'{origin}/?{urlencode(query)}',
            headers={'Origin': origin},
            transports=['websocket'],
            socketio_path=_SOCKET,
            wait_timeout=_UP_S,
        )
        await self._ask(everything=True)

    async def _ask(self, *, everything: bool) -> None:
        answer = ['true' if everything else 'false']
        await self._socket.emit('event', {**self._event, 'args': answer})

    async def _on_script(self, message: dict[str, Any]) -> None:
        if '"apply"' in message.get('code', '') and self._socket.connected:
            self.frames += 1
            await self._ask(everything=False)

    async def close(self) -> None:
        """Disconnect."""
        await self._socket.disconnect()


@contextmanager
def dashboard_clients(url: str, count: int) -> Iterator[list[DashboardClient]]:
    """Keep a page open in a number of clients, which run in a thread of their own.

    Raises:
        GoalreachError: It is not a live page.
        TimeoutError: It does not answer.
    """
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, name='dashboard clients', daemon=True)
    thread.start()
    clients = [DashboardClient() for _ in range(count)]
    try:
        for client in clients:
            opening = asyncio.wait_for(client.open(url), 2 * _UP_S)
            asyncio.run_coroutine_threadsafe(opening, loop).result()
        yield clients
    finally:
        for client in clients:
            asyncio.run_coroutine_threadsafe(client.close(), loop).result(_UP_S)
        loop.call_soon_threadsafe(loop.stop)
        thread.join(_UP_S)
        loop.close()
