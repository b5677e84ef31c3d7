"""Connects the live page to a graph: what it publishes, its parameters, commands to it."""

import contextlib
from functools import partial
import time
from typing import Any, Final

from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from goalreach_dashboard.ros.commands import GraphCommands
from goalreach_dashboard.ros.listener import GraphListener
from goalreach_dashboard.state import PageState
from goalreach_dashboard.views.page import View, page_view
from goalreach_msgs_py.arena import ARENA_PARAMETERS, Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.parameters import parameter_infos
from goalreach_msgs_py.topics import CONTROLLER, NODES, ROBOT, STATE

_LINGER_S: Final = 5.0
"""Time after the last browser has gone for which the page stays subscribed: a reload keeps the
trails. Chosen."""
_ROBOTS_PERIOD_S: Final = 1.0
"""Time between two looks for robots. Chosen."""
_PERIOD_S: Final = 0.25
"""A node that does not publish counts as down when it has not responded for 0.8 s; a response
costs it half a millisecond."""
_TIMEOUT_S: Final = 0.75
_POLLED: Final = {
    ROBOT: ('clock', 'speed', *ARENA_PARAMETERS, *parameter_infos(NoiseModel, 'noise.')),
    CONTROLLER: ('mode', 'learn', 'stamped_cmd_vel'),
}
_ANY_PARAMETER: Final = ('use_sim_time',)


class ParameterPoller:
    """Gets parameters of every node four times a second, by a node on an executor.

    Calls: `get_parameters` of the four nodes.
    """

    def __init__(self, node: Node, state: PageState) -> None:
        self._state = state
        self._clients: dict[str, Client[Any, Any]] = {
            name: node.create_client(GetParameters, f'{name}/get_parameters') for name in NODES
        }
        self._called_s: dict[str, float] = {}
        self._pending: dict[str, Any] = {}

    def poll(self, now_s: float) -> None:
        """Call the nodes that are due; drop calls that have timed out."""
        for name, client in self._clients.items():
            elapsed_s = now_s - self._called_s.get(name, 0.0)
            if name in self._pending:
                if elapsed_s < _TIMEOUT_S:
                    continue
                client.remove_pending_request(self._pending.pop(name))
            if elapsed_s < _PERIOD_S or not client.service_is_ready():
                continue
            names = _POLLED.get(name, _ANY_PARAMETER)
            future = client.call_async(GetParameters.Request(names=names))
            self._called_s[name] = now_s
            self._pending[name] = future
            future.add_done_callback(partial(self._on_response, name, names))

    def _on_response(self, node: str, names: tuple[str, ...], future: Any) -> None:
        self._pending.pop(node, None)
        if future.cancelled() or future.exception() is not None:
            return
        values = [parameter_value_to_python(value) for value in future.result().values]
        parameters = dict(zip(names, values, strict=False))
        self._state.health.record_response(node, time.monotonic())
        before, self._state.parameters[node] = self._state.parameters[node], parameters
        if node == ROBOT and parameters != before:
            with contextlib.suppress(ConfigurationError):  # another project's robot
                self._state.set_arena(Arena.from_parameters(parameters))


class GraphClient:
    """The page's two nodes and what it knows of the graph; never blocks.

    Messages are taken from the first node when the page draws; the second node's executor handles
    responses of services, also when the page draws. The arena is that given until the parameters
    of the robot in the namespace describe another.

    Attributes:
        robots: Namespaces of the domain's robots, this one included; the default one is empty.
        state: What the page shows.
        commands: Commands to the nodes; responses arrive while `update` is called.
    """

    def __init__(self, arena: Arena, robot: str = '') -> None:
        self._robot = robot
        self._robots_due_s = 0.0
        self.robots = [robot]
        self.state = PageState(arena=arena)
        self._nodes = [
            Node(name, namespace=robot, enable_rosout=False, start_parameter_services=False)
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

    def update(self, *, watched: bool) -> bool:
        """Take what has arrived; return whether the page is subscribed.

        It is while the page is watched, that is while a browser is open, and for 5 s after.
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
            if now_s >= self._robots_due_s:
                self._robots_due_s = now_s + _ROBOTS_PERIOD_S
                self.robots = sorted({self._robot, *_robots(self._nodes[0])})
        return subscribed

    def _handle_responses(self) -> None:
        """Handle all events that have come: of each response first itself, then its callback."""
        for _ in range(2):
            last = self._executor.create_task(lambda: None)
            while not last.done():
                self._executor.spin_once(timeout_sec=0.0)

    def view(self) -> View:
        """Return the page as it is to be shown now; after the end of a run, as it was then."""
        if not self.state.ended or not self._view:
            shown = page_view(self.state, time.monotonic())
            self._view = {**shown, 'robot': self._robot, 'robots': self.robots}
        return self._view

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        for node in self._nodes:
            node.destroy_node()


def _robots(node: Node) -> list[str]:
    """Return the namespaces in which a region state is published."""
    return [
        name.removesuffix(STATE).strip('/')
        for name, types in node.get_topic_names_and_types()
        if name.endswith(STATE)
        and 'diagnostic_msgs/msg/DiagnosticArray' in types
        and node.count_publishers(name)
    ]
