"""The web server of the live page and the browsers it serves.

The page is a skeleton whose elements are named; the server sends each browser the difference to
what it shows, and the next one only after the browser has painted the last.
"""

from collections.abc import Mapping
from importlib import resources
import math
import os
from pathlib import Path
import socket
import time
from typing import Any, Final

from fastapi import FastAPI
from fastapi import Request as WebRequest
from nicegui import app, context, ui
from nicegui.events import GenericEventArguments
import uvicorn

from goalreach_dashboard.ros.graph import GraphClient
from goalreach_dashboard.views.svg import View, difference
from goalreach_dashboard.web.access import MAY_STEER, AccessMiddleware, AccessPolicy
from goalreach_dashboard.web.controls import SteeringControls, add_appearance, add_read_only_note
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, use_profile
from goalreach_msgs_py.ros.process import StopRequest, terminate_with_launcher

_PERIOD_S: Final = 0.049
"""Gives 20 frames a second: timers of the event loop are about a millisecond late."""
_IDLE_PERIOD_S: Final = 0.2
"""Period without browsers: finished paths are still counted."""
_KEEPALIVE_S: Final = 1.0
"""An unchanged page is sent an empty difference so often; a browser reloads after 3 s of none."""
_MAX_WEBSOCKET_BYTES: Final = 1 << 18
_SHUTDOWN_S: Final = 1
_NICENESS: Final = 10
"""The page yields to the graph where both want the same core."""
_STATIC: Final = Path(str(resources.files('goalreach_dashboard'))) / 'static'


class LiveView(ui.element, component=_STATIC / 'live.js'):  # type: ignore[call-arg] # its types are not read
    """The part of the page that differences are applied to."""

    def __init__(self, skeleton: str) -> None:
        super().__init__()
        self._props['skeleton'] = skeleton

    def toggle_class(self, name: str, on: bool) -> None:  # noqa: FBT001 - an event's value
        """Add or remove a CSS class of the page's body."""
        self.run_method('toggleClass', name, on)


class _Viewer:
    """One open browser: its page, what it shows, and whether it has painted that."""

    def __init__(self, live: LiveView, steering: SteeringControls | None) -> None:
        self._live = live
        self._steering = steering
        self._shown: View = {}
        self._ready = False
        self._sent_s = -math.inf

    def painted(self, *, reset: bool) -> None:
        """Note that the browser is ready; `reset` means that it shows nothing yet."""
        self._ready = True
        if reset:
            self._shown = {}

    def show(self, view: View, settings: Mapping[str, Any]) -> None:
        """Send what has changed; nothing while the last difference is not painted yet."""
        if self._steering is not None:
            self._steering.update(settings)
        now_s = time.monotonic()
        due = now_s - self._sent_s >= _KEEPALIVE_S
        if not self._ready or (view is self._shown and not due):
            return
        patch = difference(view, self._shown)
        if patch or due:
            self._ready, self._shown, self._sent_s = False, view, now_s
            self._live.run_method('apply', patch)


class PageServer:
    """Serves the page; reads the graph 20 times a second in the same event loop.

    Args:
        graph: The graph.
        policy: Who may view and steer.
    """

    def __init__(self, graph: GraphClient, policy: AccessPolicy) -> None:
        self._graph = graph
        self._policy = policy
        self._viewers: dict[str, _Viewer] = {}
        self._view: View = {}
        self._settings: dict[str, Any] = {}
        self._idle_until_s = 0.0
        self._skeleton = (_STATIC / 'page.html').read_text(encoding='utf-8')

    def run(self, listener: socket.socket) -> None:
        """Serve until SIGINT or SIGTERM."""
        web = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
        app.add_static_files('/dashboard', str(_STATIC))
        app.timer(_PERIOD_S, self._update)
        ui.page('/', title='goalreach', favicon=_STATIC / 'icon.svg')(self._build)
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
            AccessMiddleware(web, self._policy),
            log_level='warning',
            access_log=False,
            ws_max_size=_MAX_WEBSOCKET_BYTES,
            timeout_graceful_shutdown=_SHUTDOWN_S,
            server_header=False,
        )
        uvicorn.Server(config).run(sockets=[listener])

    def _update(self) -> None:
        """Read the graph and send the view to the browsers; without one, read less often."""
        now_s, watched = time.monotonic(), bool(self._viewers)
        if not watched and now_s < self._idle_until_s:
            return
        self._idle_until_s = now_s + _IDLE_PERIOD_S
        self._graph.update(watched=watched)
        if watched:
            self._view, self._settings = self._graph.view(), self._graph.settings()
            for viewer in list(self._viewers.values()):
                viewer.show(self._view, self._settings)

    def _build(self, request: WebRequest) -> None:
        """Build the page of one browser."""
        ui.add_head_html('<link rel="stylesheet" href="/dashboard/dashboard.css">')
        ui.colors(primary='#0072b2')
        client = context.client
        theme = ui.dark_mode(None)
        may_steer = bool(request.scope.get(MAY_STEER, False))
        with ui.element('main').classes('page'):
            live = LiveView(self._skeleton)
            with ui.element('section').classes('panel controls').props('aria-label=Controls'):
                steering = self._add_steering(live) if may_steer else None
                if steering is None:
                    add_read_only_note()
                add_appearance(theme, live.toggle_class)
        viewer = _Viewer(live, steering)

        def on_next(event: GenericEventArguments) -> None:
            viewer.painted(reset=event.args is True)
            self._viewers[client.id] = viewer
            viewer.show(self._view, self._settings)

        live.on('next', on_next)
        client.on_disconnect(lambda: self._viewers.pop(client.id, None))

    def _add_steering(self, live: LiveView) -> SteeringControls:
        steering = SteeringControls(
            self._graph.commands, lambda: self._graph.state.arena, live.toggle_class
        )

        async def on_place(event: GenericEventArguments) -> None:
            await steering.place(event.args)

        live.on('place', on_place)
        return steering


def serve(listener: socket.socket, *, arena: Arena, token: str | None, local: bool) -> int:
    """Serve the page until Ctrl-C or SIGTERM.

    Args:
        listener: The listening socket.
        arena: The arena, until the robot's parameters describe another.
        token: Secret of the URL: needed to steer on this machine, to view from another.
        local: Whether only this machine can reach the page.

    Returns:
        Exit status.
    """
    terminate_with_launcher()
    os.nice(_NICENESS)
    use_profile(fast_dds_profile())
    stop = StopRequest()
    port = int(listener.getsockname()[1])
    policy = AccessPolicy(port=port, token=token, local=local)
    graph = GraphClient(arena)
    try:
        PageServer(graph, policy).run(listener)
    finally:
        graph.close()
    return 0 if stop.requested else 1
