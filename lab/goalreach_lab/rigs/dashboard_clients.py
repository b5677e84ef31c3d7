"""Clients of the dashboard that paint nothing: they take each frame and ask for the next.

A browser without a graphics card spends most of its processor time on painting. These clients
speak the same protocol and need hardly any processor time, so that the cost of the page can be
measured apart from that of browsers on the same machine.
"""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager, suppress
import json
import threading
from typing import Final
from urllib.parse import urlsplit

from goalreach_msgs_py.errors import GoalreachError

_UP_S: Final = 30.0


class DashboardClient:
    """One client of a page.

    Attributes:
        frames: Updates received so far.
    """

    def __init__(self) -> None:
        """Prepare; nothing is opened yet."""
        self.frames = 0
        self._following: asyncio.Task[None] | None = None

    async def open(self, url: str) -> None:
        """Connect to the page, without its token.

        Raises:
            GoalreachError: It is not a live page.
        """
        from websockets.asyncio.client import connect
        from websockets.exceptions import WebSocketException

        address = urlsplit(url).netloc
        try:
            self._socket = await connect(f'ws://{address}/live', origin=f'http://{address}')  # type: ignore[arg-type] # a text
            await self._socket.send('{"token": null}')
            await self._socket.recv()
        except (OSError, WebSocketException) as error:
            raise GoalreachError(f'{url}: is not a live page: {error}') from None
        self._following = asyncio.create_task(self._follow())

    async def _follow(self) -> None:
        from websockets.exceptions import ConnectionClosed

        with suppress(ConnectionClosed):
            await self._socket.send('{"next": true}')
            async for message in self._socket:
                if 'show' in json.loads(message):
                    self.frames += 1
                    await self._socket.send('{"next": false}')

    async def close(self) -> None:
        """Disconnect."""
        if self._following is not None:
            await self._socket.close()
            await self._following


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
