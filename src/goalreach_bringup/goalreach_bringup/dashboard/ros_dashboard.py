"""The page's process: listens to the graph in the main thread, serves the page in another."""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Final

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from goalreach_bringup.dashboard.board import Board
from goalreach_bringup.dashboard.page_state import PageState
from goalreach_bringup.dashboard.page_view import page_view
from goalreach_bringup.dashboard.ros_listener import Listener
from goalreach_bringup.dashboard.ros_questions import Questions, noise_of
from goalreach_bringup.dashboard.ros_steering import Steering
from goalreach_bringup.dashboard.summary_view import run_status
from goalreach_bringup.run.plan import CONTROLLER, ROBOT
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.ros_glimpse import next_look_s

__all__ = ['GraphSide']

_UNWATCHED_S: Final = 0.2
"""Between two looks while no page is open: the counters must go on, and no more."""


class GraphSide:
    """The page's two nodes: one that listens, and one that asks.

    Args:
        arena: The arena, until the robot tells another.
        board: Where views go and requests come from.
        steers: Whether requests are carried out.
    """

    def __init__(self, arena: Arena, board: Board, *, steers: bool) -> None:
        """Join the graph."""
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        self.state = PageState(arena=arena)
        self._board = board
        self._ears = Node('dashboard', enable_rosout=False, start_parameter_services=False)
        self._mouth = Node('dashboard_asks', enable_rosout=False, start_parameter_services=False)
        self._listener = Listener(self._ears, self.state)
        self._questions = Questions(self._mouth, self.state)
        self._steering = Steering(self._mouth, self.state) if steers else None
        self._executor = EventsExecutor()
        self._executor.add_node(self._mouth)

    def run(self, goes_on: Callable[[], bool]) -> None:
        """Renew the view 20 times a second while watched, until `goes_on` says no."""
        due_s = time.monotonic()
        while rclpy.ok() and goes_on():
            now_s = time.monotonic()
            if now_s < due_s:
                self._executor.spin_once(timeout_sec=due_s - now_s)
                continue
            due_s = next_look_s(now_s) if self._board.viewers else now_s + _UNWATCHED_S
            self._tick(now_s)

    def _tick(self, now_s: float) -> None:
        watched = self._board.viewers > 0
        self._listener.listen(with_image=watched)
        self._questions.ask(now_s)
        if self._steering is not None:
            for request, answer in self._board.asked():
                self._questions.hurry(now_s)
                self._steering.carry_out(request, answer)
        if watched:
            self._board.show(page_view(self.state, time.monotonic()), self._values(now_s))

    def _values(self, now_s: float) -> dict[str, object]:
        robot = self.state.parameters[ROBOT]
        return {
            'paused': run_status(self.state, now_s) == 'paused',
            'mode': self.state.parameters[CONTROLLER].get('mode'),
            'speed': robot.get('speed'),
            'clock': robot.get('clock'),
            'noise': noise_of(robot),
        }

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        for node in (self._ears, self._mouth):
            node.destroy_node()
        rclpy.try_shutdown()
