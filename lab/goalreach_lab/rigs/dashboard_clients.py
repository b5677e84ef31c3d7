"""Clients of the dashboard that paint nothing: they take each frame and ask for the next.

A browser without a graphics card spends most of its processor time on painting. These clients
speak the same protocol and need hardly any processor time, so that the cost of the page can be
measured apart from that of browsers on the same machine.
"""

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
import json
import threading
from typing import Final
from urllib.parse import urlsplit

from goalreach_msgs_py.errors import GoalreachError

_UP_S: Final = 30.0


class DashboardClient:
    """One client of a page, without its token; it follows the page in a thread of its own.

    Args:
        url: Address of the page.

    Attributes:
        frames: Updates received so far.

    Raises:
        GoalreachError: It is not a live page.
    """

    def __init__(self, url: str) -> None:
        from websockets.exceptions import WebSocketException
        from websockets.sync.client import connect

        self.frames = 0
        address = urlsplit(url).netloc
        try:
            self._socket = connect(f'ws://{address}/live', origin=f'http://{address}')  # type: ignore[arg-type] # a text
            self._socket.send('{"token": null}')
            self._socket.recv(_UP_S)
        except (OSError, WebSocketException) as error:
            raise GoalreachError(f'{url}: is not a live page: {error}') from None
        self._following = threading.Thread(target=self._follow, daemon=True)
        self._following.start()

    def _follow(self) -> None:
        from websockets.exceptions import ConnectionClosed

        with suppress(ConnectionClosed):
            self._socket.send('{"next": true}')
            for message in self._socket:
                if 'show' in json.loads(message):
                    self.frames += 1
                    self._socket.send('{"next": false}')

    def close(self) -> None:
        """Disconnect."""
        self._socket.close()
        self._following.join(_UP_S)


@contextmanager
def dashboard_clients(url: str, count: int) -> Iterator[list[DashboardClient]]:
    """Keep a page open in a number of clients.

    Raises:
        GoalreachError: It is not a live page.
    """
    with ExitStack() as stack:
        yield [stack.enter_context(closing(DashboardClient(url))) for _ in range(count)]
