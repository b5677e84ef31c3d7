"""Injects faults into a live stack."""

from collections.abc import Iterator
import math
import os
from pathlib import Path
import resource
import signal
import subprocess
import tempfile
from typing import Any, Final

from geometry_msgs.msg import PolygonStamped, TwistStamped
import numpy as np
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import SetBool, Trigger

from goalreach_evaluation.starts import random_starts
from goalreach_lab.faults.kinds import FaultKind
from goalreach_lab.faults.ros_faulted_graph import FaultedGraph
from goalreach_lab.faults.ros_gates import PREFIX
from goalreach_lab.rigs.processes import find_descendant
from goalreach_lab.rigs.stack import start_command
from goalreach_msgs_py.arena import BODY_RADIUS_M, DEFAULT_LANDMARKS_M, Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, stamp_to_msg
from goalreach_msgs_py.topics import CMD_VEL, LANDMARKS, PAUSE_SERVICE, RESET_SERVICE, ROBOT

_ANSWER_S: Final = 10.0
_SLOW_STOPPED_S: Final = 0.6
_SLOW_RUNNING_S: Final = 0.1
_CLEARANCE_M: Final = 0.6
_WRITES_BYTES: Final = 400_000
_FREE_BYTES: Final = 1_500_000
_FULL_S: Final = 3.0
_NEIGHBOR_S: Final = 2.0
_OBSTACLE_M: Final = (1.778, 3.6 + BODY_RADIUS_M)
"""The robot's place when it touches the obstacle of obstacle.yaml from behind: x, y."""

_ARRAY = Parameter.Type.DOUBLE_ARRAY
_NODE_ACTS: Final = ('stop', 'slow')


class Injector:
    """Injects one fault after the other; one private method for each `FaultKind.act`.

    Args:
        graph: The stack under test.
        rng: Draws places, LEDs and bumpers.

    Attributes:
        begun: Whether the last fault that lasts has begun.
    """

    def __init__(self, graph: FaultedGraph, rng: np.random.Generator) -> None:
        """Make the clients."""
        self._graph, self._rng, self.begun = graph, rng, False
        node = graph.node
        self._parameters = AsyncParameterClient(node, ROBOT)
        self._reset = node.create_client(Trigger, RESET_SERVICE)
        self._pause = node.create_client(SetBool, PAUSE_SERVICE)
        self._second_node = graph.add_node('second_publisher')
        self._seen: list[int] = []
        node.create_subscription(PolygonStamped, LANDMARKS, self._on_landmarks, RELIABLE_QOS)

    def _on_landmarks(self, message: PolygonStamped) -> None:
        points = message.polygon.points
        self._seen = [led for led, point in enumerate(points) if not math.isnan(point.x)]

    def inject(self, kind: FaultKind) -> None:
        """Begin a fault, let it last, and end it.

        Raises:
            GoalreachError: The stack does not answer.
        """
        self.begun = False
        getattr(self, f'_{kind.act}', self._gate)(kind)

    def _last(self, kind: FaultKind) -> None:
        self.begun = True
        speed = 1.0 if kind.act in _NODE_ACTS else self._graph.speed
        self._graph.serve(kind.duration_s / speed)

    def _kill(self, kind: FaultKind) -> None:
        os.kill(self._graph.running.node_pid(kind.target), signal.SIGKILL)

    def _stop(self, kind: FaultKind) -> None:
        pid = self._graph.running.node_pid(kind.target)
        os.kill(pid, signal.SIGSTOP)
        try:
            self._last(kind)
        finally:
            os.kill(pid, signal.SIGCONT)

    def _slow(self, kind: FaultKind) -> None:
        pid = self._graph.running.node_pid(kind.target)
        for _ in range(round(kind.duration_s / (_SLOW_STOPPED_S + _SLOW_RUNNING_S))):
            os.kill(pid, signal.SIGSTOP)
            self._graph.serve(_SLOW_STOPPED_S)
            os.kill(pid, signal.SIGCONT)
            self._graph.serve(_SLOW_RUNNING_S)

    def _gate(self, kind: FaultKind) -> None:
        if self._graph.gates is None:
            raise GoalreachError('this stack has no gates')
        self._graph.gates.set(kind.target, kind.act, kind.amount)
        self._last(kind)
        self._graph.gates.set(kind.target)

    def _while_set(self, kind: FaultKind, name: str, value: object, normal: object) -> None:
        """Set a parameter of the robot while a fault lasts."""
        array = _ARRAY if isinstance(value, list) else None
        self._set(name, array, value)
        self._last(kind)
        self._set(name, array, normal)

    def _parameter(self, kind: FaultKind) -> None:
        self._while_set(kind, kind.target, value=True, normal=False)

    def _dark(self, kind: FaultKind) -> None:
        every = range(len(DEFAULT_LANDMARKS_M))
        dark = every if kind.amount > 1 else [self._rng.choice(self._seen or every)]
        self._while_set(kind, 'faults.dark_leds', [float(number) for number in dark], [])

    def _light(self, kind: FaultKind) -> None:
        """Turn on a further light between the LEDs that are seen."""
        seen = [DEFAULT_LANDMARKS_M[led] for led in self._seen] or DEFAULT_LANDMARKS_M
        x_m, y_m, z_m = np.mean(seen, axis=0).tolist()
        across_m, up_m = self._rng.uniform(-0.15, 0.15, size=2).tolist()
        self._while_set(kind, 'faults.extra_light_m', [x_m + across_m, y_m, z_m + up_m], [])

    def _bumper(self, kind: FaultKind) -> None:
        self._while_set(kind, 'faults.stuck_bumper', int(self._rng.integers(20)), -1)

    def _somewhere(self) -> list[float]:
        pose = random_starts(Arena(), 1, self._rng, clearance_m=_CLEARANCE_M)[0]
        turn_rad = self._rng.uniform(-0.5, 0.5) - math.pi / 2
        return [pose.x_m, pose.y_m, turn_rad]

    def _carry(self, _kind: FaultKind) -> None:
        self._set('faults.carry_to', _ARRAY, self._somewhere())

    def _place(self, _kind: FaultKind) -> None:
        self.put(self._somewhere())

    def put(self, pose: list[float]) -> None:
        """Place the robot at a pose, as at the beginning of a path.

        Raises:
            GoalreachError: It does not answer, or the pose is in a wall.
        """
        self._set('start_pose', _ARRAY, pose)
        self._await(self._reset.call_async(Trigger.Request()))

    def _stall(self, kind: FaultKind) -> None:
        self._await(self._pause.call_async(SetBool.Request(data=True)))
        self._last(kind)
        self._await(self._pause.call_async(SetBool.Request(data=False)))

    def _disk(self, _kind: FaultKind) -> None:
        """Start a recorder, then limit the size of its files."""
        with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
            bag = Path(folder) / 'bag'
            process = self._start('record', str(bag))
            try:
                written = self._wait_for_bag(bag)
                limit = written + _FREE_BYTES
                resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (limit, limit))
                self._graph.serve_until(lambda: process.poll() is not None, _FULL_S)
            finally:
                self._finish(process)

    def _wait_for_bag(self, bag: Path) -> int:
        def size() -> int:
            return sum(path.stat().st_size for path in bag.glob('*'))

        if not self._graph.serve_until(lambda: size() > _WRITES_BYTES, _ANSWER_S):
            raise GoalreachError('the recorder does not write')
        return size()

    def _vanish(self, kind: FaultKind) -> None:
        self._graph.kill_robot()
        self._last(kind)
        self._graph.start_robot()

    def _obstruct(self, _kind: FaultKind) -> None:
        """Put the robot closely before the obstacle, facing it and the goal behind it."""
        across_m, gap_m = self._rng.uniform((-0.1, 0.05), (0.1, 0.15)).tolist()
        self.put([_OBSTACLE_M[0] + across_m, _OBSTACLE_M[1] + gap_m, -math.pi / 2])

    def _stack(self, _kind: FaultKind) -> None:
        process = self._start('run', '--paths', '1', '--no-dashboard')
        self._graph.serve_until(lambda: process.poll() is not None, 2 * _ANSWER_S)
        self._finish(process)

    def _neighbor(self, _kind: FaultKind) -> None:
        """Bring up another robot in the same domain, and kill the process of that robot."""
        process = self._start('run', '--namespace', 'neighbor', '--no-dashboard')
        try:
            up = self._graph.serve_until(
                lambda: find_descendant(process.pid, ROBOT) is not None, _ANSWER_S
            )
            pid = find_descendant(process.pid, ROBOT)
            if not up or pid is None:
                raise GoalreachError('the second robot does not come up')
            self._graph.serve(_NEIGHBOR_S)
            os.kill(pid, signal.SIGKILL)
            self._graph.serve(_NEIGHBOR_S)
        finally:
            self._finish(process)

    def _start(self, *words: str) -> subprocess.Popen[str]:
        return start_command(*words, environment=self._graph.running.environment)

    def _finish(self, process: subprocess.Popen[str]) -> None:
        """End a process, and add what it printed to the observed lines."""
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        if not self._graph.serve_until(lambda: process.poll() is not None, _ANSWER_S):
            process.kill()
        text = process.communicate()[0]
        self._graph.observer.lines.extend(text.splitlines())

    def _second(self, kind: FaultKind) -> None:
        outlet = self._second_node.create_publisher(TwistStamped, PREFIX + CMD_VEL, RELIABLE_QOS)
        for _ in self._ticks(kind.duration_s):
            message = TwistStamped()
            message.header.stamp = stamp_to_msg(self._graph.observer.clock_ns)
            message.twist.linear.x = kind.amount
            outlet.publish(message)
        self._second_node.destroy_publisher(outlet)

    def _ticks(self, seconds: float) -> Iterator[int]:
        for tick in range(round(25 * seconds)):
            yield tick
            self._graph.serve(0.04 / self._graph.speed)

    def _set(self, name: str, kind: Parameter.Type | None = None, value: object = None) -> None:
        parameter = Parameter(name, kind, value)
        answer = self._await(self._parameters.set_parameters([parameter]))
        if not answer.results[0].successful:
            raise GoalreachError(answer.results[0].reason)

    def _await(self, future: Any) -> Any:
        if not self._graph.serve_until(future.done, _ANSWER_S):
            raise GoalreachError('a service of the robot does not answer')
        return future.result()
