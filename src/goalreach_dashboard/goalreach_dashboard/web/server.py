"""The web server of the live page and the browsers it serves.

The page is a document whose elements are named; over a websocket the server sends each browser the
difference to what it shows, and the next one only after the browser has painted the last.
"""

import asyncio
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from importlib import resources
import json
import logging
import math
import os
from pathlib import Path
import secrets
import socket
import tarfile
import time
from typing import Any, Final
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect
import uvicorn

from goalreach_dashboard.address import REQUEST
from goalreach_dashboard.ros.graph import GraphClient
from goalreach_dashboard.views.page import CHOICES, View, difference, replay
from goalreach_dashboard.web.access import AccessMiddleware, AccessPolicy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import CommandError, GoalreachError
from goalreach_msgs_py.ros.node import ros_session
from goalreach_msgs_py.ros.process import StopRequest, terminate_with_launcher

_LOG: Final = logging.getLogger(__name__)
_PERIOD_S: Final = 0.05
"""20 frames a second at most, however fast a browser asks."""
_IDLE_PERIOD_S: Final = 0.2
"""Period without browsers: finished paths are still counted."""
_KEEPALIVE_S: Final = 1.0
"""An unchanged page is sent an empty difference so often."""
_MAX_WEBSOCKET_BYTES: Final = 1 << 14
_FAREWELL_S: Final = 0.5
"""Longest wait for a browser to accept the last frame. Chosen."""
_SHUTDOWN_S: Final = 1
_NICENESS: Final = 10
"""The page yields to the graph where both want the same core."""
_POLICY_VIOLATION: Final = 1008
_CHUNK_BYTES: Final = 1 << 18
_STATIC: Final = Path(str(resources.files('goalreach_dashboard'))) / 'static'


class RunLink:
    """The run that started the page: reads what it reports, and sends it requests of the page.

    The launcher appends JSON objects to a file, one a line; the page prints its requests, and the
    launcher reads them from the page's log.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open(encoding='utf-8')
        self._partial = ''

    def events(self) -> list[Mapping[str, Any]]:
        """Return what has been reported since the last call."""
        *lines, self._partial = (self._partial + self._file.read()).split('\n')
        return [json.loads(line) for line in lines]

    def send(self, **values: object) -> None:
        """Send the launcher a request, or the number of browsers."""
        print(REQUEST + json.dumps(values), flush=True)


def tar_of(folder: Path) -> Iterator[bytes]:
    """Yield a tar archive of the files of a folder, without holding any of them in memory."""
    for path in sorted(each for each in folder.iterdir() if each.is_file()):
        info = tarfile.TarInfo(f'{folder.name}/{path.name}')
        info.size, info.mtime = path.stat().st_size, int(path.stat().st_mtime)
        yield info.tobuf()
        with path.open('rb') as file:
            left = info.size
            while chunk := file.read(min(_CHUNK_BYTES, left)):
                left -= len(chunk)
                yield chunk
        yield bytes(left + -info.size % tarfile.BLOCKSIZE)
    yield bytes(2 * tarfile.BLOCKSIZE)


class _Viewer:
    """One open browser: its robot, what it shows of it, and whether it has painted that."""

    def __init__(self, websocket: WebSocket, graph: GraphClient, *, steers: bool) -> None:
        self.graph = graph
        self.steers = steers
        self._websocket = websocket
        self._shown: View = {}
        self._ready = False
        self._sent_s = -math.inf
        self._event = 0
        self._sending: asyncio.Task[None] | None = None

    def painted(self, *, reset: bool) -> None:
        """Note that the browser is ready; `reset` means that it shows nothing yet."""
        self._ready = True
        if reset:
            self._shown, self._event = {}, 0

    def show(self, view: View, events: Mapping[int, object], *, last: bool = False) -> None:
        """Send what has changed; nothing while the last frame is not painted or not yet sent.

        The last view of all is sent also to a browser that does not paint. Events are by ascending
        number.
        """
        now_s = time.monotonic()
        due = now_s - self._sent_s >= _KEEPALIVE_S
        busy = self._sending is not None and not self._sending.done()
        if busy or not (self._ready or last):
            return
        patch = difference(view, self._shown) if view is not self._shown else {}
        new = [event for number, event in events.items() if number > self._event]
        if patch or new or due:
            self._ready, self._shown, self._sent_s = False, view, now_s
            self._event = max(events, default=0)
            self._sending = asyncio.create_task(self.send({'show': patch, 'events': new}))

    async def send(self, message: Mapping[str, object]) -> None:
        """Send a message; a browser that has gone gets none."""
        with suppress(WebSocketDisconnect, RuntimeError):
            await self._websocket.send_text(json.dumps(message))

    async def settle(self) -> None:
        """Wait until the last frame has been accepted."""
        if self._sending is not None:
            await asyncio.wait([self._sending], timeout=_FAREWELL_S)


class PageServer:
    """Serves the page; reads the graph 20 times a second in the same event loop.

    A browser first shows the robot of the namespace given, in the arena given until the robot's
    parameters describe another.
    """

    def __init__(
        self, arena: Arena, robot: str, policy: AccessPolicy, run: RunLink | None
    ) -> None:
        self._arena = arena
        self._graph = GraphClient(arena, robot)
        self._graphs = {robot: self._graph}
        self._policy = policy
        self._run = run
        self._viewers: set[_Viewer] = set()
        self._ticket = ''

    def serve(self, listener: socket.socket) -> None:
        """Serve until SIGINT or SIGTERM."""
        routes = [
            Route('/bag/{ticket}', self._bag),
            WebSocketRoute('/live', self._live),
            Mount('/', StaticFiles(directory=_STATIC, html=True)),
        ]
        config = uvicorn.Config(
            AccessMiddleware(Starlette(routes=routes, lifespan=self._lifespan), self._policy),
            log_level='warning',
            access_log=False,
            ws='websockets-sansio',
            ws_max_size=_MAX_WEBSOCKET_BYTES,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=_SHUTDOWN_S,
            server_header=False,
        )
        self._server = _Uvicorn(config, self)
        self._server.run(sockets=[listener])

    @asynccontextmanager
    async def _lifespan(self, _app: Starlette) -> AsyncIterator[None]:
        task = asyncio.create_task(self._follow())
        yield
        task.cancel()

    async def _follow(self) -> None:
        """Read the graph and show it to the browsers; without one, read less often."""
        due_s = time.monotonic()
        try:
            while True:
                self._update()
                due_s += _PERIOD_S if self._viewers else _IDLE_PERIOD_S
                due_s = max(due_s, time.monotonic())
                await asyncio.sleep(due_s - time.monotonic())
        except Exception:  # noqa: BLE001 - reported; a page that stands still would claim to be live
            _LOG.exception('the page cannot go on')
            self._server.should_exit = True

    def _take_events(self) -> None:
        for event in self._run.events() if self._run else ():
            self._graph.state.add_event(event)

    def _update(self, *, last: bool = False) -> None:
        self._take_events()
        for robot, graph in [*self._graphs.items()]:
            viewers = [viewer for viewer in self._viewers if viewer.graph is graph]
            if not graph.update(watched=bool(viewers)) and graph is not self._graph:
                self._graphs.pop(robot).close()
            view = graph.view() if viewers else {}
            for viewer in viewers:
                viewer.show(view, graph.state.events, last=last)

    def close(self) -> None:
        """Leave the graphs."""
        for graph in self._graphs.values():
            graph.close()

    def _choose(self, viewer: _Viewer, robot: object) -> None:
        """Show a browser another robot of the domain."""
        if isinstance(robot, str) and robot in viewer.graph.robots:
            if robot not in self._graphs:
                self._graphs[robot] = GraphClient(self._arena, robot)
            viewer.graph = self._graphs[robot]
            viewer.painted(reset=True)

    async def farewell(self) -> None:
        """Show the browsers that the page ends, and with it the run that started it."""
        state = self._graph.state
        self._take_events()
        if self._run is not None and not state.ended:
            state.add_event({'event': 'end', 'reason': 'its launcher ended'})
        await asyncio.gather(*(viewer.settle() for viewer in self._viewers))
        self._update(last=True)
        await asyncio.gather(*(viewer.settle() for viewer in self._viewers))

    async def _bag(self, request: Request) -> Response:
        """Return the recorded bag; a ticket, given to who may steer, is valid once."""
        ticket, self._ticket = self._ticket, ''
        folder = self._graph.state.bag
        if not ticket or request.path_params['ticket'] != ticket or not folder:
            return Response('this link has been used\n', 404)
        name = quote(Path(folder).name)
        headers = {'content-disposition': f"attachment; filename*=UTF-8''{name}.tar"}
        return StreamingResponse(
            tar_of(Path(folder)), headers=headers, media_type='application/x-tar'
        )

    async def _live(self, websocket: WebSocket) -> None:
        """Serve one browser; one that sends what no page sends is disconnected."""
        await websocket.accept()
        viewer: _Viewer | None = None
        commands: set[asyncio.Task[None]] = set()
        with suppress(WebSocketDisconnect, ValueError, KeyError, RecursionError):
            token = _message(await websocket.receive_text()).get('token')
            if self._policy.may_view(token):
                viewer = _Viewer(websocket, self._graph, steers=self._policy.may_steer(token))
                offered = {'launched': self._run is not None, **CHOICES}
                await viewer.send({'hello': {'steers': viewer.steers, **offered}})
                self._viewers.add(viewer)
                self._count_viewers()
            while viewer is not None:
                message = _message(await websocket.receive_text())
                if 'next' in message:
                    viewer.painted(reset=message['next'] is True)
                elif 'robot' in message:
                    self._choose(viewer, message['robot'])
                elif viewer.steers:
                    commands.add(task := asyncio.create_task(self._answer(viewer, message)))
                    task.add_done_callback(commands.discard)
        if viewer is not None:
            self._viewers.discard(viewer)
            self._count_viewers()
        with suppress(RuntimeError, WebSocketDisconnect):
            await websocket.close(_POLICY_VIOLATION)

    def _count_viewers(self) -> None:
        if self._run is not None:
            self._run.send(viewers=len(self._viewers))

    async def _answer(self, viewer: _Viewer, message: Mapping[str, Any]) -> None:
        """Execute a command and report its outcome."""
        try:
            do, value = message.get('do'), message.get('value')
            await viewer.send(await self._execute(viewer.graph, do, value))
        except GoalreachError as error:
            await viewer.send({'answer': f'refused: {error}'})

    async def _execute(
        self, graph: GraphClient, name: object, value: object
    ) -> Mapping[str, object]:
        if name == 'bag':
            self._ticket = secrets.token_urlsafe(16)
            return {'ticket': self._ticket}
        if name == 'replay':
            return {'replay': replay(graph.state)}
        if name in ('start', 'stop', 'record'):
            if self._run is None or graph is not self._graph:
                raise CommandError('this page was not started by a run of this robot')
            self._run.send(request=name, value=value)
            return {}
        return {'answer': await graph.commands.execute(name, value)}


class _Uvicorn(uvicorn.Server):
    """The server; before it closes the connections, the browsers are shown the end."""

    def __init__(self, config: uvicorn.Config, page: PageServer) -> None:
        super().__init__(config)
        self._page = page

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Show the end, then close."""
        await self._page.farewell()
        await super().shutdown(sockets)


def _message(text: str) -> Mapping[str, Any]:
    """Return what a browser sent.

    Raises:
        ValueError: It is no JSON object.
    """
    message = json.loads(text)
    if not isinstance(message, dict):
        raise ValueError(text)  # noqa: TRY004 - a wrong value from outside
    return message


def serve(
    listener: socket.socket,
    *,
    arena: Arena,
    token: str | None,
    local: bool,
    events: Path | None = None,
    robot: str = '',
) -> int:
    """Serve the page until Ctrl-C or SIGTERM; return the exit status.

    Args:
        listener: The listening socket.
        arena: The arena, until the robot's parameters describe another.
        token: Secret of the URL: needed to steer on this machine, to view from another.
        local: Whether only this machine can reach the page.
        events: File in which the run that started the page reports what happens, or None.
        robot: Namespace of the robot that the page shows first.
    """
    terminate_with_launcher()
    os.nice(_NICENESS)
    stop = StopRequest()
    port = int(listener.getsockname()[1])
    policy = AccessPolicy(port=port, token=token, local=local)
    with ros_session() as stack:
        page = PageServer(arena, robot, policy, RunLink(events) if events else None)
        stack.callback(page.close)
        page.serve(listener)
    return 0 if stop.requested else 1
