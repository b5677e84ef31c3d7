"""The page's process: listens to the graph in the main thread, serves the page in another."""

from __future__ import annotations

from collections.abc import Callable
import os
import socket
import time
from typing import Final

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from goalreach_dashboard.exchange import Board
from goalreach_dashboard.ros.commands import Steering
from goalreach_dashboard.ros.listener import GraphListener
from goalreach_dashboard.ros.parameters import Questions, noise_of
from goalreach_dashboard.state import PageState
from goalreach_dashboard.views.page import page_view, run_status
from goalreach_dashboard.web.access import Door
from goalreach_dashboard.web.server import PageServer
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile
from goalreach_msgs_py.ros.node import StopRequest, end_with_launcher
from goalreach_msgs_py.topics import CONTROLLER, ROBOT

_WATCHED_PERIOD_S: Final = 0.05
_IDLE_PERIOD_S: Final = 0.2
"""Period of the updates while no browser is open: finished paths are still counted."""
_LINGER_S: Final = 5.0
"""Time after the last browser has gone for which the page stays subscribed: a reload keeps the
trails. Chosen."""


class GraphSide:
    """The page's two nodes: one that listens, and one that asks.

    Args:
        arena: The arena, until the robot tells another.
        board: Where views go and requests come from.
        steers: Whether requests are carried out.
    """

    def __init__(self, arena: Arena, board: Board, *, steers: bool) -> None:
        """Join the graph."""
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        self.state = PageState(arena=arena)
        self._board = board
        self._ears = Node('dashboard', enable_rosout=False, start_parameter_services=False)
        self._mouth = Node('dashboard_asks', enable_rosout=False, start_parameter_services=False)
        self._listener = GraphListener(self._ears, self.state)
        self._questions = Questions(self._mouth, self.state)
        self._steering = Steering(self._mouth, self.state) if steers else None
        self._linger_until_s = 0.0
        self._executor = EventsExecutor()
        self._executor.add_node(self._mouth)

    def run(self, goes_on: Callable[[], bool]) -> None:
        """Renew the view 20 times a second while watched, until `goes_on` says no."""
        due_s = time.monotonic()
        while rclpy.ok() and goes_on():
            now_s = time.monotonic()
            if now_s < due_s:
                self._executor.spin_once(timeout_sec=due_s - now_s)
                continue
            watched = self._board.viewers > 0
            due_s = max(due_s, now_s) + (_WATCHED_PERIOD_S if watched else _IDLE_PERIOD_S)
            self._tick(now_s)

    def _tick(self, now_s: float) -> None:
        watched = self._board.viewers > 0
        if watched:
            self._linger_until_s = now_s + _LINGER_S
        subscribed = now_s < self._linger_until_s
        self._listener.watch(watched=subscribed)
        self._listener.update()
        if subscribed:
            self._questions.ask(now_s)
        if self._steering is not None:
            for request, answer in self._board.asked():
                self._questions.hurry(now_s)
                self._steering.carry_out(request, answer)
        if watched:
            self._board.show(page_view(self.state, time.monotonic()), self._values(now_s))

    def _values(self, now_s: float) -> dict[str, object]:
        robot = self.state.parameters[ROBOT]
        return {
            'paused': run_status(self.state, now_s) == 'paused',
            'mode': self.state.parameters[CONTROLLER].get('mode'),
            'speed': robot.get('speed'),
            'clock': robot.get('clock'),
            'noise': noise_of(robot),
        }

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        for node in (self._ears, self._mouth):
            node.destroy_node()
        rclpy.try_shutdown()


_NICENESS = 10
"""The page gives way to the graph where both want the same core."""


def serve(listener: socket.socket, *, arena: Arena, token: str | None, local: bool) -> int:
    """Serve the page until Ctrl-C or SIGTERM.

    Args:
        listener: The bound socket.
        arena: The arena, until the robot tells another.
        token: What must be shown: to steer on this machine, to look from another.
        local: Whether only this machine can reach the page.
    """
    end_with_launcher()
    os.nice(_NICENESS)
    os.environ.setdefault('FASTRTPS_DEFAULT_PROFILES_FILE', fast_dds_profile())
    stop = StopRequest()
    port = int(listener.getsockname()[1])
    if local or token is None:
        door = Door.loopback(port, token=token)
    else:
        door = Door.network(port, token=token)
    board = Board()
    graph = GraphSide(arena, board, steers=door.steers)
    server = PageServer(listener, door, board, lambda: graph.state.arena)
    server.start()
    try:
        graph.run(lambda: not stop.requested and server.alive)
    finally:
        server.stop()
        graph.close()
    return 0 if stop.requested else 1
