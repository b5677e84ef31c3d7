"""Brings the two sides of the page together and lets them run."""

from __future__ import annotations

import os
import socket

from goalreach_bringup.dashboard.board import Board
from goalreach_bringup.dashboard.guard import Door
from goalreach_bringup.dashboard.page_server import PageServer
from goalreach_bringup.dashboard.ros_dashboard import GraphSide
from goalreach_bringup.run.environment import fast_dds_profile
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.ros_node import StopRequest, end_with_launcher

__all__ = ['serve']

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
