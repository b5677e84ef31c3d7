"""Placing and pausing the simulated robot through the services of `nomad200`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import SetBool, Trigger

from goalreach_msgs_py.topics import PAUSE_SERVICE, RESET_SERVICE
from goalreach_msgs_py.values import Pose2

__all__ = ['RobotPlacement']

_ROBOT = 'nomad200'
_POLL_S = 0.05
_COMPLAIN_S = 5.0


class RobotPlacement:
    """Calls the robot's services without ever blocking the executor.

    Args:
        node: The node whose executor serves the calls.
    """

    def __init__(self, node: Node) -> None:
        """Make the clients."""
        self._node = node
        self._parameters = AsyncParameterClient(node, _ROBOT)
        self._reset = node.create_client(Trigger, RESET_SERVICE)
        self._pause = node.create_client(SetBool, PAUSE_SERVICE)
        self._waiting: Callable[[], None] | None = None
        self._timer = node.create_timer(
            _POLL_S, self._poll, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        self._timer.cancel()

    def place(self, start: Pose2, done: Callable[[], None]) -> None:
        """Put the robot at a pose, then call `done`; a refusal is logged and ends the mission."""
        pose = [start.x_m, start.y_m, start.heading_rad]

        def set_start() -> None:
            request = [Parameter('start_pose', Parameter.Type.DOUBLE_ARRAY, pose)]
            future = self._parameters.set_parameters(request)
            future.add_done_callback(reset)

        def reset(future: Any) -> None:
            result = future.result().results[0]
            if not result.successful:
                self._refused(result.reason)
                return
            self._reset.call_async(Trigger.Request()).add_done_callback(finish)

        def finish(future: Any) -> None:
            if not future.result().success:
                self._refused(future.result().message)
                return
            done()

        self._when_ready(set_start)

    def pause(self, done: Callable[[], None]) -> None:
        """Pause the simulation, then call `done`."""

        def call() -> None:
            future = self._pause.call_async(SetBool.Request(data=True))
            future.add_done_callback(lambda _: done())

        self._when_ready(call)

    def _when_ready(self, action: Callable[[], None]) -> None:
        self._waiting = action
        self._timer.reset()
        self._poll()

    def _poll(self) -> None:
        ready = (
            self._parameters.services_are_ready()
            and self._reset.service_is_ready()
            and self._pause.service_is_ready()
        )
        if self._waiting is None or not ready:
            if self._waiting is not None:
                self._node.get_logger().warning(
                    f'waiting for the services of {_ROBOT}',
                    throttle_duration_sec=_COMPLAIN_S,
                    skip_first=True,
                )
            return
        action, self._waiting = self._waiting, None
        self._timer.cancel()
        action()

    def _refused(self, reason: str) -> None:
        self._node.get_logger().error(f'{_ROBOT} refused the start: {reason}')
