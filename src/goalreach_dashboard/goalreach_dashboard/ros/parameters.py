"""Polls the parameters of the nodes: their settings, and whether they respond."""

from collections.abc import Mapping
import contextlib
from dataclasses import fields
from functools import partial
import time
from typing import Any, Final

from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from goalreach_dashboard.state import PageState
from goalreach_msgs_py.arena import ARENA_PARAMETERS, Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.topics import CONTROLLER, NODES, ROBOT

_PERIOD_S: Final = 0.25
"""A node that does not publish counts as down when it has not responded for 0.8 s; a response
costs it half a millisecond."""
_TIMEOUT_S: Final = 0.75
_NOISE: Final = tuple(f'noise.{field.name}' for field in fields(NoiseModel))
_POLLED: Final = {
    ROBOT: ('clock', 'speed', *ARENA_PARAMETERS, *_NOISE),
    CONTROLLER: ('mode', 'learn'),
}
_ANY_PARAMETER: Final = ('use_sim_time',)


class ParameterPoller:
    """Gets parameters of every node four times a second.

    Calls: `get_parameters` of the four nodes.

    Args:
        node: A node on an executor.
        state: The state to update.
    """

    def __init__(self, node: Node, state: PageState) -> None:
        self._state = state
        self._clients: dict[str, Client[Any, Any]] = {
            name: node.create_client(GetParameters, f'/{name}/get_parameters') for name in NODES
        }
        self._called_s: dict[str, float] = {}
        self._pending: dict[str, Any] = {}
        self._robot_parameters: Mapping[str, Any] = {}

    def poll(self, now_s: float) -> None:
        """Call the nodes that are due; drop calls that have timed out.

        Args:
            now_s: Time of the monotonic clock.
        """
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
        self._state.parameters[node] = parameters
        if node == ROBOT and parameters != self._robot_parameters:
            self._robot_parameters = parameters
            with contextlib.suppress(ConfigurationError):  # a robot of somebody else
                self._state.set_arena(Arena.from_parameters(parameters))
