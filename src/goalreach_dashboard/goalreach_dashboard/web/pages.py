"""The page: a skeleton that patches fill, and controls for those who may steer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
import contextlib
from importlib import resources
import math
from pathlib import Path
import time
from typing import Final

from fastapi import Request as WebRequest
from nicegui import app, background_tasks, context, ui
from nicegui.events import GenericEventArguments

from goalreach_dashboard.exchange import Board
from goalreach_dashboard.views.svg import View, difference
from goalreach_dashboard.web.access import DRIVER
from goalreach_dashboard.web.controls import Controls
from goalreach_msgs_py.arena import Arena

_ALIVE_S: Final = 1.0
_STATIC: Final = Path(str(resources.files('goalreach_dashboard'))) / 'static'


class Live(ui.element, component=_STATIC / 'live.js'):  # type: ignore[call-arg] # its types are not read
    """The part of the page that patches fill."""

    def __init__(self, skeleton: str) -> None:
        super().__init__()
        self._props['skeleton'] = skeleton


class _Viewer:
    """One open page: what it shows, and whether it has painted that."""

    def __init__(self, live: Live) -> None:
        self.live = live
        self.shown: View = {}
        self.ready = False
        self.sent_s = -math.inf
        self.controls: Controls | None = None

    def show(self, view: View, now_s: float) -> None:
        """Send what changed; nothing while the last patch is not painted yet."""
        if not self.ready or (view is self.shown and now_s - self.sent_s < _ALIVE_S):
            return
        patch = difference(view, self.shown)
        if not patch and now_s - self.sent_s < _ALIVE_S:
            return
        self.ready, self.shown, self.sent_s = False, view, now_s
        self.live.run_method('apply', patch)


class Pages:
    """All open pages.

    Args:
        board: Where views come from and requests go.
        arena: Returns the arena of the picture.
    """

    def __init__(self, board: Board, arena: Callable[[], Arena]) -> None:
        self._board = board
        self._arena = arena
        self._viewers: dict[str, _Viewer] = {}
        self._turn = asyncio.Event()
        self._skeleton = (_STATIC / 'page.html').read_text(encoding='utf-8')

    def serve(self) -> None:
        """Tell NiceGUI of the page and begin to send."""
        app.add_static_files('/dashboard', str(_STATIC))
        app.on_startup(lambda: background_tasks.create(self._send(), name='views'))
        ui.page('/', title='goalreach', favicon=_STATIC / 'icon.svg')(self._page)

    def _page(self, request: WebRequest) -> None:
        ui.add_head_html('<link rel="stylesheet" href="/dashboard/dashboard.css">')
        ui.colors(primary='#0072b2')
        client = context.client
        theme = ui.dark_mode(None)
        with ui.element('main').classes('page'):
            viewer = _Viewer(Live(self._skeleton))
            viewer.controls = Controls(
                self._board,
                self._arena,
                mark=lambda name, on: viewer.live.run_method('mark', name, on),
                theme=theme,
                steers=bool(request.scope.get(DRIVER, False)),
            )
        controls = viewer.controls

        def on_next(event: GenericEventArguments) -> None:
            if event.args is True:
                viewer.shown = {}
            viewer.ready = True
            self._turn.set()
            self._viewers[client.id] = viewer
            self._board.viewers = len(self._viewers)

        async def on_place(event: GenericEventArguments) -> None:
            await controls.place(event.args)

        viewer.live.on('next', on_next)
        if controls.steers:
            viewer.live.on('place', on_place)
        client.on_disconnect(lambda: self._forget(client.id))

    def _forget(self, client_id: str) -> None:
        self._viewers.pop(client_id, None)
        self._board.viewers = len(self._viewers)

    async def _send(self) -> None:
        """Send each new view to every page that is ready, and to the others when they are."""
        loop = asyncio.get_running_loop()

        def wake() -> None:
            with contextlib.suppress(RuntimeError):  # the loop has ended before the graph
                loop.call_soon_threadsafe(self._turn.set)

        self._board.on_view = wake
        while True:
            await self._turn.wait()
            self._turn.clear()
            now_s = time.monotonic()
            view, controls = self._board.view, self._board.controls
            for viewer in list(self._viewers.values()):
                viewer.show(view, now_s)
                if viewer.controls is not None:
                    viewer.controls.follow(controls)
