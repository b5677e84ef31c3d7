"""Placing and pausing the simulated robot, and waiting without blocking the executor."""

from collections.abc import Callable
import time
from typing import Any, Final

from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import SetBool, Trigger

from goalreach_msgs_py.ros.messaging import steady_timer
from goalreach_msgs_py.topics import PAUSE_SERVICE, RESET_SERVICE, ROBOT
from goalreach_msgs_py.values import Pose2

_POLL_S: Final = 0.005
_WARN_S: Final = 5.0
_ANSWER_S: Final = 2.0
"""Time for an answer, seconds of the wall clock, after which a call is made again. Chosen."""


class ConditionWait:
    """Runs an action once a condition holds, checked at once and then by a timer.

    Args:
        node: The node whose executor serves the timer.
        condition: Whether the action may run.
        warning: Logged every 5 s while it does not hold.
    """

    def __init__(self, node: Node, condition: Callable[[], bool], warning: str) -> None:
        self._node = node
        self._condition = condition
        self._warning = warning
        self._action: Callable[[], None] | None = None
        self._warned_s = 0.0
        self._timer = steady_timer(node, _POLL_S, self._poll)
        self._timer.cancel()

    def run(self, action: Callable[[], None]) -> None:
        """Run an action now, or later from the timer; it replaces one that still waits."""
        self._action = action
        self._warned_s = time.monotonic()
        self._timer.reset()
        self._poll()

    def _poll(self) -> None:
        if self._action is None:
            return
        if self._condition():
            action, self._action = self._action, None
            self._timer.cancel()
            action()
        elif time.monotonic() - self._warned_s >= _WARN_S:
            self._warned_s = time.monotonic()
            self._node.get_logger().warning(self._warning)


class RobotPlacement:
    """Calls the robot's services without blocking the executor.

    A call whose answer does not come, because the robot's node has died or a message got lost, is
    made again from the beginning.

    Args:
        node: The node whose executor serves the calls.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._parameters = AsyncParameterClient(node, ROBOT)
        self._reset = node.create_client(Trigger, RESET_SERVICE)
        self._pause = node.create_client(SetBool, PAUSE_SERVICE)
        self._services = ConditionWait(
            node, self._services_are_ready, f'waiting for the services of {ROBOT}'
        )
        self._request: Callable[[], None] | None = None
        self._attempt = 0
        self._deadline = steady_timer(node, _ANSWER_S, self._on_deadline)
        self._deadline.cancel()

    def place(self, start: Pose2, done: Callable[[], None]) -> None:
        """Put the robot at a pose, then call `done`; a refusal is logged and ends the mission."""
        pose = [start.x_m, start.y_m, start.heading_rad]

        def set_start() -> None:
            request = [Parameter('start_pose', Parameter.Type.DOUBLE_ARRAY, pose)]
            self._then(self._parameters.set_parameters(request), reset)

        def reset(answer: Any) -> None:
            result = answer.results[0]
            if result.successful:
                self._then(self._reset.call_async(Trigger.Request()), finish)
            else:
                self._refused(result.reason)

        def finish(answer: Any) -> None:
            if answer.success:
                self._end()
                done()
            else:
                self._refused(answer.message)

        self._begin(set_start)

    def pause(self, done: Callable[[], None]) -> None:
        """Pause the simulation, then call `done`."""

        def pause() -> None:
            self._then(self._pause.call_async(SetBool.Request(data=True)), finish)

        def finish(_answer: Any) -> None:
            self._end()
            done()

        self._begin(pause)

    def _services_are_ready(self) -> bool:
        return bool(
            self._parameters.services_are_ready()
            and self._reset.service_is_ready()
            and self._pause.service_is_ready()
        )

    def _begin(self, request: Callable[[], None]) -> None:
        def send() -> None:
            self._deadline.reset()
            request()

        self._request = send
        self._services.run(send)

    def _then(self, future: Any, step: Callable[[Any], None]) -> None:
        """Go on with the answer, unless the call has been made again meanwhile."""
        attempt = self._attempt

        def on_answer(future: Any) -> None:
            if attempt == self._attempt:
                step(future.result())

        future.add_done_callback(on_answer)

    def _on_deadline(self) -> None:
        self._deadline.cancel()
        if self._request is not None:
            self._node.get_logger().warning(f'{ROBOT} does not answer; asking again')
            self._attempt += 1
            self._services.run(self._request)

    def _end(self) -> None:
        self._request = None
        self._attempt += 1
        self._deadline.cancel()

    def _refused(self, reason: str) -> None:
        self._end()
        self._node.get_logger().error(f'{ROBOT} refused the start: {reason}')
