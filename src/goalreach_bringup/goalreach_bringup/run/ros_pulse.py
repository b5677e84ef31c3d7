"""Whether a node still answers: a small service call, repeated."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node
from rclpy.parameter_client import AsyncParameterClient

__all__ = ['Pulse']

_PERIOD_S = 1.0
_START_S = 20.0


class Pulse:
    """Asks a node for a parameter every second and notes when it last answered.

    Args:
        watcher: The node that asks.
        name: The node that is asked.
        limit_s: Silence after which it counts as hung, once it has answered.
    """

    def __init__(self, watcher: Node, name: str, *, limit_s: float = 4.0) -> None:
        """Make the client."""
        self.limit_s = limit_s
        self._client = AsyncParameterClient(watcher, name)
        self._asked_s: float | None = None
        self._pending: list[Any] = []
        self._heard_s: float | None = None
        self._began_s: float | None = None

    def restart(self, now_s: float) -> None:
        """Forget the past: the node is being started anew."""
        self._began_s, self._heard_s, self._asked_s = now_s, None, None
        self._pending.clear()

    def silent(self, now_s: float) -> bool:
        """Ask again where it is time; return whether the node has been silent for too long."""
        if self._began_s is None:
            self._began_s = now_s
        if any(call.done() for call in self._pending):
            self._heard_s = now_s
            self._pending.clear()
        due = self._asked_s is None or now_s - self._asked_s >= _PERIOD_S
        if due and self._client.services_are_ready():
            # A call can be lost with the process that it went to: never wait for one alone.
            self._pending.append(self._client.get_parameters(['use_sim_time']))
            self._asked_s = now_s
        if self._heard_s is None:
            return now_s - self._began_s > _START_S
        return now_s - self._heard_s > self.limit_s
