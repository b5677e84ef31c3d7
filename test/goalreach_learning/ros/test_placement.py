"""Waiting, and calling the robot's services, without blocking the executor."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from goalreach_learning.ros.placement import ConditionWait, RobotPlacement
from goalreach_msgs_py.values import Pose2
import graphs

pytestmark = pytest.mark.graph

LIMIT_S = 90.0
Server = Callable[[Callable[[], bool], float], bool]
START = Pose2(x_m=1.0, y_m=2.0, heading_rad=0.5)


@pytest.mark.parametrize('holds', [False, True])
def test_an_action_runs_once_as_soon_as_the_condition_holds(*, holds: bool) -> None:
    ran: list[int] = []
    holding = [holds]
    with graphs.onlooker(graphs.fresh_domain()) as (node, serve_until):
        wait = ConditionWait(node, lambda: holding[0], 'waiting')
        wait.run(lambda: ran.append(1))
        assert bool(ran) is holds
        assert serve_until(lambda: bool(ran), 0.2) is holds
        holding[0] = True
        assert serve_until(lambda: bool(ran), 90.0)
        assert not serve_until(lambda: len(ran) > 1, 0.2)


class Robot:
    """The services of the robot; they answer only while they are served."""

    def __init__(self, node: Node) -> None:
        self.calls: list[str] = []
        self.accepts = True
        self.node = Node('nomad200', context=node.context, enable_rosout=False)
        self.node.declare_parameter('start_pose', [0.0, 0.0, 0.0])
        self.node.create_service(Trigger, '~/reset', self._reset)
        self.node.create_service(SetBool, '~/pause', self._pause)
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(self.node)

    def _reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.calls.append(f'reset to {list(self.node.get_parameter("start_pose").value)}')
        response.success = self.accepts
        return response

    def _pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self.calls.append('pause' if request.data else 'resume')
        return response

    def serve(self) -> None:
        """Answer what has been asked."""
        self._executor.spin_once(timeout_sec=0.0)

    def close(self) -> None:
        """Withdraw the services."""
        self._executor.shutdown()
        self.node.destroy_node()


@contextmanager
def placed() -> Iterator[
    tuple[RobotPlacement, Robot, Callable[[Callable[[], bool], float], bool]]
]:
    with graphs.onlooker(graphs.fresh_domain()) as (node, serve_until):
        robot = Robot(node)
        try:
            yield RobotPlacement(node, ''), robot, serve_until
        finally:
            robot.close()


def test_calls_without_an_answer_are_made_again_from_the_first() -> None:
    done: list[int] = []
    with placed() as (placement, robot, serve_until):
        placement.place(START, lambda: done.append(1))
        assert not serve_until(lambda: bool(done), 2.5)  # longer than an answer may take

        def placed_by_now() -> bool:
            robot.serve()
            return bool(done)

        assert serve_until(placed_by_now, LIMIT_S)
        assert robot.calls == ['resume', 'resume', 'reset to [1.0, 2.0, 0.5]']
        placement.pause(lambda: done.append(2))
        assert serve_until(lambda: placed_by_now() and len(done) > 1, LIMIT_S)
        assert robot.calls[3:] == ['pause']
        assert done == [1, 2]


def test_a_refused_start_ends_the_mission() -> None:
    done: list[int] = []
    with placed() as (placement, robot, serve_until):

        def calls(count: int) -> bool:
            robot.serve()
            return len(robot.calls) >= count

        robot.accepts = False
        placement.place(START, lambda: done.append(1))
        assert serve_until(lambda: calls(2), LIMIT_S)
        assert not serve_until(lambda: calls(3), 2.5)  # nor is it asked again
        assert not done
        robot.accepts = True
        placement.place_anywhere(lambda: done.append(2))
        assert serve_until(lambda: calls(3) and bool(done), LIMIT_S)
        assert robot.calls[2:] == ['reset to [1.0, 2.0, 0.5]']
        assert done == [2]
