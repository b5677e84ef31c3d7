"""Placing and pausing the simulated robot, and waiting without blocking the executor."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
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


@dataclass
class ConditionWait:
    """Runs an action once a condition holds, checked at once and then by a timer."""

    node: Node
    condition: Callable[[], bool]
    warning: str

    def __post_init__(self) -> None:
        self._action: Callable[[], None] | None = None
        self._timer = steady_timer(self.node, _POLL_S, self._poll)
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
        if self.condition():
            action, self._action = self._action, None
            self._timer.cancel()
            action()
        elif time.monotonic() - self._warned_s >= _WARN_S:
            self._warned_s = time.monotonic()
            self.node.get_logger().warning(self.warning)


_Calls = Generator[Any, Any, str | None]
"""Yields the futures of calls, is sent their answers, and returns why the robot refused, if so."""


class RobotPlacement:
    """Calls the robot's services, or one that chooses the start, without blocking the executor.

    Calls whose answer does not come, because the robot's node has died or a message got lost, are
    made again from the first.
    """

    def __init__(self, node: Node, service: str) -> None:
        self._node = node
        self._chooses_start = bool(service)
        self._parameters = AsyncParameterClient(node, ROBOT)
        self._reset = node.create_client(Trigger, service or RESET_SERVICE.removeprefix('/'))
        self._pause = node.create_client(SetBool, PAUSE_SERVICE.removeprefix('/'))
        self._services = ConditionWait(
            node, self._services_are_ready, f'waiting for {service or f"the services of {ROBOT}"}'
        )
        self._begin: Callable[[], None] = lambda: None
        self._calls: _Calls | None = None
        self._resumed = False
        self._deadline = steady_timer(node, _ANSWER_S, self._on_deadline)
        self._deadline.cancel()

    def place(self, start: Pose2, done: Callable[[], None]) -> None:
        """Put the robot at a pose, then call `done`; a refusal is logged and ends the mission.

        A robot that outlives a mission was paused at its end: the first call resumes it.
        """
        pose = [start.x_m, start.y_m, start.heading_rad]

        def calls() -> _Calls:
            if not self._resumed:
                yield self._pause.call_async(SetBool.Request(data=False))
                self._resumed = True
            request = [Parameter('start_pose', Parameter.Type.DOUBLE_ARRAY, pose)]
            result = (yield self._parameters.set_parameters(request)).results[0]
            return (yield from self._call_reset()) if result.successful else result.reason

        self._run(calls, done)

    def place_anywhere(self, done: Callable[[], None]) -> None:
        """Have the service put the robot at a start, as long as it takes, then call `done`."""

        def calls() -> _Calls:
            self._deadline.cancel()
            return (yield from self._call_reset())

        self._run(calls, done)

    def _call_reset(self) -> _Calls:
        answer = yield self._reset.call_async(Trigger.Request())
        return None if answer.success else answer.message

    def pause(self, done: Callable[[], None]) -> None:
        """Pause the simulation, then call `done`."""

        def calls() -> _Calls:
            yield self._pause.call_async(SetBool.Request(data=True))
            return None

        self._run(calls, done)

    def _services_are_ready(self) -> bool:
        placed = self._parameters.services_are_ready() and self._pause.service_is_ready()
        return bool(self._reset.service_is_ready() and (placed or self._chooses_start))

    def _run(self, calls: Callable[[], _Calls], done: Callable[[], None]) -> None:
        """Make calls one after the other once the services are ready, then call `done`."""

        def begin() -> None:
            self._deadline.reset()
            self._calls = calls()
            go_on(self._calls, None)

        def go_on(made: _Calls, answer: Any) -> None:
            if made is not self._calls:  # they have been made again meanwhile
                return
            try:
                future = made.send(answer)
            except StopIteration as end:
                self._calls = None
                self._deadline.cancel()
                if end.value is None:
                    done()
                else:
                    self._node.get_logger().error(f'{ROBOT} refused the start: {end.value}')
            else:
                future.add_done_callback(lambda future: go_on(made, future.result()))

        self._begin = begin
        self._services.run(begin)

    def _on_deadline(self) -> None:
        self._deadline.cancel()
        self._node.get_logger().warning(f'{ROBOT} does not answer; asking again')
        self._calls = None
        self._services.run(self._begin)
