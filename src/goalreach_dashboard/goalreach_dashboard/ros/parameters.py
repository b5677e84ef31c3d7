"""Asks every node for its parameters, again and again: what it is set to, and that it lives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from functools import partial
import time
from typing import Any, Final

from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from goalreach_dashboard.state import PageState
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NOISE_PRESETS, NoiseModel, noise_preset
from goalreach_msgs_py.regions import RegionConfig
from goalreach_msgs_py.topics import CONTROLLER, NODES, ROBOT

_PERIOD_S: Final = 0.25
_HEARD_PERIOD_S: Final = 1.0
"""To answer takes a node half a millisecond; one that is heard need not prove that it lives."""
_PATIENCE_S: Final = 0.75
_HURRY_S: Final = 2.0
_ARENA: Final = (
    'arena_width_m',
    'arena_length_m',
    'landmarks_m',
    'x_knots_m',
    'y_knots_m',
    'goal_region',
)
_NOISE: Final = tuple(f'noise.{field.name}' for field in fields(NoiseModel))
_ASKED: Final = {
    ROBOT: ('clock', 'speed', *_ARENA, *_NOISE),
    CONTROLLER: ('mode', 'learn'),
}
_ANYTHING: Final = ('use_sim_time',)
_SAME: Final = 1e-9


class Questions:
    """One question to each node every second, and every quarter of one where it is not heard.

    Args:
        node: A node on an executor.
        state: Where the answers go.
    """

    def __init__(self, node: Node, state: PageState) -> None:
        """Make the clients."""
        self._state = state
        self._clients: dict[str, Client[Any, Any]] = {
            name: node.create_client(GetParameters, f'/{name}/get_parameters') for name in NODES
        }
        self._asked_s: dict[str, float] = {}
        self._open: dict[str, Any] = {}
        self._robot_answer: Mapping[str, Any] = {}
        self._hurries_until_s = 0.0

    @property
    def waiting(self) -> bool:
        """Whether an answer is awaited."""
        return bool(self._open)

    def hurry(self, now_s: float) -> None:
        """Ask all as often as those that are not heard, for a moment: something is changed."""
        self._hurries_until_s = now_s + _HURRY_S

    def ask(self, now_s: float) -> None:
        """Ask those whose turn it is; give up questions that stayed without an answer."""
        for name, client in self._clients.items():
            waited_s = now_s - self._asked_s.get(name, 0.0)
            if name in self._open:
                if waited_s < _PATIENCE_S:
                    continue
                client.remove_pending_request(self._open.pop(name))
            if waited_s < self._period_s(name, now_s) or not client.service_is_ready():
                continue
            names = _ASKED.get(name, _ANYTHING)
            future = client.call_async(GetParameters.Request(names=names))
            self._asked_s[name] = now_s
            self._open[name] = future
            future.add_done_callback(partial(self._on_answer, name, names))

    def _period_s(self, name: str, now_s: float) -> float:
        heard = self._state.health.silent_s(name, now_s) < _PERIOD_S
        return _HEARD_PERIOD_S if heard and now_s >= self._hurries_until_s else _PERIOD_S

    def _on_answer(self, node: str, names: tuple[str, ...], future: Any) -> None:
        self._open.pop(node, None)
        if future.cancelled() or future.exception() is not None:
            return
        values = [parameter_value_to_python(value) for value in future.result().values]
        told = dict(zip(names, values, strict=False))
        self._state.health.record_answer(node, time.monotonic())
        self._state.parameters[node] = told
        if node == ROBOT and told != self._robot_answer:
            self._robot_answer = told
            arena = arena_of(told, self._state.arena)
            if arena is not None:
                self._state.set_arena(arena)


def arena_of(told: Mapping[str, Any], present: Arena) -> Arena | None:
    """Return the arena that a robot's parameters describe, or None where they do not.

    Args:
        told: Parameters by name.
        present: The arena so far; it lends its starts and its name where all else is the same.
    """
    try:
        flat = tuple(told['landmarks_m'])
        regions = RegionConfig(
            x_knots_m=tuple(told['x_knots_m']),
            y_knots_m=tuple(told['y_knots_m']),
            goal_region=told['goal_region'],
        ).region_map
        return Arena(
            width_m=told['arena_width_m'],
            length_m=told['arena_length_m'],
            landmarks_m=tuple(flat[k : k + 3] for k in range(0, len(flat), 3)),
            regions=regions,
            starts=(),
            name=present.name,
        )
    except (KeyError, TypeError, ConfigurationError):
        return None


def noise_of(told: Mapping[str, Any]) -> str | None:
    """Return the noise preset that a robot's parameters agree with, or None."""
    for name in NOISE_PRESETS:
        model = noise_preset(name)
        expected = {f'noise.{f.name}': getattr(model, f.name) for f in fields(NoiseModel)}
        if all(
            isinstance(told.get(key), float) and abs(told[key] - value) < _SAME
            for key, value in expected.items()
        ):
            return name
    return None
