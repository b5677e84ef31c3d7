"""The web server of the page, in a thread of its own."""

from __future__ import annotations

from collections.abc import Callable
import socket
import threading
from typing import Final

from fastapi import FastAPI
from nicegui import ui
import uvicorn

from goalreach_dashboard.exchange import Board
from goalreach_dashboard.web.access import Door, Guard
from goalreach_dashboard.web.pages import Pages
from goalreach_msgs_py.arena import Arena

_MESSAGE_BYTES: Final = 1 << 18
_GRACE_S: Final = 1
_JOIN_S: Final = 3.0


class PageServer:
    """Serves the page until it is stopped.

    Args:
        listener: The bound socket.
        door: How far the page is open.
        board: Where views come from and requests go.
        arena: Returns the arena of the picture.
    """

    def __init__(
        self, listener: socket.socket, door: Door, board: Board, arena: Callable[[], Arena]
    ) -> None:
        web = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
        Pages(board, arena).serve()
        ui.run_with(
            web,
            title='goalreach',
            language='en-US',
            dark=None,
            tailwind=False,
            message_history_length=0,
            reconnect_timeout=5.0,
            show_welcome_message=False,
        )
        config = uvicorn.Config(
            Guard(web, door),
            log_level='warning',
            access_log=False,
            ws_max_size=_MESSAGE_BYTES,
            timeout_graceful_shutdown=_GRACE_S,
            server_header=False,
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(
            target=self._server.run, kwargs={'sockets': [listener]}, name='web', daemon=True
        )

    def start(self) -> None:
        """Begin to serve."""
        self._thread.start()

    @property
    def alive(self) -> bool:
        """Whether it serves."""
        return self._thread.is_alive()

    def stop(self) -> None:
        """Close all pages and end."""
        self._server.should_exit = True
        self._thread.join(_JOIN_S)
