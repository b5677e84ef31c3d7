"""Placing and pausing the simulated robot through the services of `nomad200`."""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import SetBool, Trigger

from goalreach_msgs_py.topics import PAUSE_SERVICE, RESET_SERVICE
from goalreach_msgs_py.values import Pose2

_ROBOT = 'nomad200'
_POLL_S = 0.05
_COMPLAIN_S = 5.0
_ANSWER_S = 2.0
"""Time for an answer, seconds of the wall clock, after which a call is made again. Chosen."""


class RobotPlacement:
    """Calls the robot's services without ever blocking the executor.

    A call whose answer does not come, because the robot's node has died or a message got lost, is
    made again from the beginning: nothing here can wait for ever.

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
        self._action: Callable[[], None] | None = None
        self._asked_s = 0.0
        self._attempt = 0
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
            future.add_done_callback(self._unless_given_up(reset))

        def reset(answer: Any) -> None:
            result = answer.results[0]
            if not result.successful:
                self._refused(result.reason)
                return
            future = self._reset.call_async(Trigger.Request())
            future.add_done_callback(self._unless_given_up(finish))

        def finish(answer: Any) -> None:
            if not answer.success:
                self._refused(answer.message)
                return
            self._answered(done)

        self._when_ready(set_start)

    def pause(self, done: Callable[[], None]) -> None:
        """Pause the simulation, then call `done`."""

        def call() -> None:
            future = self._pause.call_async(SetBool.Request(data=True))
            future.add_done_callback(self._unless_given_up(lambda _: self._answered(done)))

        self._when_ready(call)

    def _when_ready(self, action: Callable[[], None]) -> None:
        self._waiting = self._action = action
        self._timer.reset()
        self._poll()

    def _unless_given_up(self, then: Callable[[Any], None]) -> Callable[[Any], None]:
        attempt = self._attempt

        def finish(future: Any) -> None:
            if attempt == self._attempt:
                then(future.result())

        return finish

    def _answered(self, done: Callable[[], None]) -> None:
        self._action = None
        self._attempt += 1
        self._timer.cancel()
        done()

    def _ask_again(self) -> None:
        if self._action is None or time.monotonic() - self._asked_s < _ANSWER_S:
            return
        self._node.get_logger().warning(f'{_ROBOT} does not answer; asking again')
        self._attempt += 1
        self._waiting = self._action

    def _poll(self) -> None:
        if self._waiting is None:
            self._ask_again()
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
        self._asked_s = time.monotonic()
        action()

    def _refused(self, reason: str) -> None:
        self._action = None
        self._timer.cancel()
        self._node.get_logger().error(f'{_ROBOT} refused the start: {reason}')
