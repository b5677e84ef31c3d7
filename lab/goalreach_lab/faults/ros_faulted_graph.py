"""A live stack with gates between its nodes, and the node that observes it."""

from collections.abc import Callable
from pathlib import Path
import subprocess
import sys
import time
from typing import Final

import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from goalreach_bringup.launch.environment import remove_abandoned
from goalreach_lab.faults.observer import StackObserver
from goalreach_lab.faults.ros_gates import Gates, gate_rules, observe_graph
from goalreach_lab.rigs.stack import Stack
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, use_profile
from goalreach_msgs_py.topics import ROBOT

_UP_S: Final = 30.0
_SPIN_S: Final = 0.01


class FaultedGraph:
    """A stack under test, up and driving.

    Args:
        domain: ROS domain.
        speed: Seconds of the graph's clock in one of the wall clock.
        seed: Seed of the run.
        log_directory: Directory of its logs.
        gates: Whether to put gates between its nodes.

    Attributes:
        observer: Observes the stack.
        node: The node of gates and observer.
        stack: The stack's processes, or None where none were started.
    """

    def __init__(
        self, *, domain: int, speed: float, seed: int, log_directory: Path, gates: bool = True
    ) -> None:
        """Prepare; nothing is started yet."""
        self._domain, self._speed, self._seed = domain, speed, seed
        self._log_directory = log_directory
        use_profile(fast_dds_profile())
        self._context = Context()
        rclpy.init(args=[], context=self._context, domain_id=domain)
        self.node = Node('fault_gate', context=self._context, enable_rosout=False)
        executor = EventsExecutor if gates else SingleThreadedExecutor
        self._executor = executor(context=self._context)
        self._executor.add_node(self.node)
        self.observer = StackObserver(Arena())
        rng = np.random.default_rng(seed)
        self.gates = Gates(self.node, speed=speed, rng=rng) if gates else None
        observe_graph(self.node, self.observer, gated=gates)
        self.stack: Stack | None = None
        self._robot: subprocess.Popen[bytes] | None = None

    @property
    def speed(self) -> float:
        """Seconds of the graph's clock in one of the wall clock."""
        return self._speed

    @property
    def running(self) -> Stack:
        """The stack.

        Raises:
            GoalreachError: It does not run.
        """
        if self.stack is None or not self.stack.alive:
            raise GoalreachError('the stack does not run')
        return self.stack

    def add_node(self, name: str) -> Node:
        """Return a further node in the same domain."""
        node = Node(name, context=self._context, enable_rosout=False)
        self._executor.add_node(node)
        return node

    def start(self, *arguments: str) -> None:
        """Start the stack and wait until it drives.

        Raises:
            GoalreachError: It does not drive within the limit.
        """
        words = ['--speed', str(self._speed), '--seed', str(self._seed), '--no-dashboard']
        if self.gates is not None:
            words += [word for rule in gate_rules() for word in ('--remap', rule)]
        named = arguments[arguments.index('--arena') + 1 :] if '--arena' in arguments else ()
        self.observer.arena = read_arena(named[0]) if named else Arena()
        self.stack = Stack(
            [*words, *arguments],
            domain=self._domain,
            log_directory=self._log_directory,
            on_line=self.observer.lines.append,
        )
        if ROBOT in arguments:
            self.start_robot()
        self.observer.reset_counts()
        if not self.serve_until(lambda: self.observer.normal_since is not None, _UP_S):
            raise GoalreachError('the stack does not drive: ' + '; '.join(self.observer.lines))

    def start_robot(self) -> None:
        """Start the robot's node as its owner does, outside the stack: `--external nomad200`."""
        rules = gate_rules() if self.gates is not None else ()
        words = [word for rule in rules for word in ('--remap', rule)]
        self._robot = subprocess.Popen(
            [sys.executable, '-m', 'goalreach_sim.nomad200_node', '--ros-args', *words],
            env=self.running.environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def kill_robot(self) -> None:
        """Kill the robot's node that was started outside the stack."""
        if self._robot is not None:
            self._robot.kill()
            self._robot.wait()

    def serve_until(self, condition: Callable[[], bool], limit_s: float) -> bool:
        """Spin until a condition holds; return whether it did within the limit.

        Args:
            condition: The condition.
            limit_s: The limit, seconds of the wall clock.
        """
        deadline_s = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > deadline_s:
                return False
            self._executor.spin_once(timeout_sec=_SPIN_S)
            if self.gates is not None:
                self.gates.release()
        return True

    def serve(self, seconds: float) -> None:
        """Spin for some seconds of the wall clock."""
        self.serve_until(lambda: False, seconds)

    def stop(self) -> None:
        """End the stack."""
        if self.stack is not None:
            self.stack.stop()
        self.kill_robot()
        self.stack = self._robot = None

    def close(self) -> None:
        """End everything; remove shared memory of killed nodes that this process had mapped."""
        self.stop()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()
        remove_abandoned()
