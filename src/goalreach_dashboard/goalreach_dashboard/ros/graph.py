"""Connects the live page to a graph."""

import time
from typing import Final

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from goalreach_dashboard.ros.commands import GraphCommands
from goalreach_dashboard.ros.listener import GraphListener
from goalreach_dashboard.ros.parameters import ParameterPoller
from goalreach_dashboard.state import PageState
from goalreach_dashboard.views.page import View, page_view
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.ros.node import NO_LOG_FILE

_LINGER_S: Final = 5.0
"""Time after the last browser has gone for which the page stays subscribed: a reload keeps the
trails. Chosen."""


class GraphClient:
    """The page's two nodes and what it knows of the graph; never blocks.

    Messages are taken from the first node when the page draws; the second node's executor handles
    responses of services, also when the page draws.

    Args:
        arena: The arena, until the robot's parameters describe another.

    Attributes:
        state: What the page shows.
        commands: Commands to the nodes; responses arrive while `update` is called.
    """

    def __init__(self, arena: Arena) -> None:
        rclpy.init(args=list(NO_LOG_FILE), signal_handler_options=SignalHandlerOptions.NO)
        self.state = PageState(arena=arena)
        self._nodes = [
            Node(name, enable_rosout=False, start_parameter_services=False)
            for name in ('dashboard', 'dashboard_client')
        ]
        polled, client = self._nodes
        self._listener = GraphListener(polled, self.state)
        self._poller = ParameterPoller(client, self.state)
        self.commands = GraphCommands(client, self.state)
        self._executor = EventsExecutor()
        self._executor.add_node(client)
        self._linger_until_s = 0.0
        self._view: View = {}

    def update(self, *, watched: bool) -> None:
        """Take what has arrived.

        Args:
            watched: Whether a browser is open.
        """
        now_s = time.monotonic()
        if watched:
            self._linger_until_s = now_s + _LINGER_S
        subscribed = now_s < self._linger_until_s
        self._listener.watch(watched=subscribed)
        self._listener.update()
        self._handle_responses()
        if subscribed:
            self._poller.poll(now_s)

    def _handle_responses(self) -> None:
        """Handle all events that have come: of each response first itself, then its callback."""
        for _ in range(2):
            last = self._executor.create_task(lambda: None)
            while not last.done():
                self._executor.spin_once(timeout_sec=0.0)

    def view(self) -> View:
        """Return the page as it is to be shown now; after the end of a run, as it was then."""
        if not self.state.ended or not self._view:
            self._view = page_view(self.state, time.monotonic())
        return self._view

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        for node in self._nodes:
            node.destroy_node()
        rclpy.try_shutdown()
