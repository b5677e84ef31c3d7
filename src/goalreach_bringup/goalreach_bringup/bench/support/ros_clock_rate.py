"""How fast the clock of a running graph really runs, and what the graph says about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import os
import re
import statistics
import subprocess
import sys
import time

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros_common_messages import stamp_from_msg
from goalreach_msgs_py.ros_qos import RELIABLE_QOS
from goalreach_msgs_py.topics import CLOCK

__all__ = ['ClockRate', 'measure_clock_rate']

_LOWEST_DOMAIN, _DOMAINS = 101, 100
_UP_S = 30.0
_SETTLE_S = 2.0
_END_S = 15.0
_SPIN_S = 0.05
_SAID = re.compile(r'too slow: ([\d.]+) times real time')


@dataclass(frozen=True, kw_only=True)
class ClockRate:
    """What was seen.

    Attributes:
        measured: Simulated seconds per wall second, from `/clock`.
        said: Mean of the speeds that the simulator told, or None where it told none.
        ticks: Ticks behind the figure.
    """

    measured: float
    said: float | None
    ticks: int


def measure_clock_rate(speed: float, seconds: float, seed: int) -> ClockRate:
    """Run the graph and compare its clock with the wall's.

    Args:
        speed: What is asked of it.
        seconds: For how long it is looked on, after it has settled.
        seed: Seed of the run.

    Raises:
        GoalreachError: The graph did not come up.
    """
    ticks: list[tuple[float, int]] = []
    domain = _LOWEST_DOMAIN + os.getpid() % _DOMAINS
    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = Node('clock_rate', context=context, enable_rosout=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def note(message: Clock) -> None:
        ticks.append((time.monotonic(), stamp_from_msg(message.clock)))

    def serve_until(condition: Callable[[], bool], limit_s: float) -> bool:
        deadline_s = time.monotonic() + limit_s
        while time.monotonic() < deadline_s and not condition():
            executor.spin_once(timeout_sec=_SPIN_S)
        return condition()

    node.create_subscription(Clock, CLOCK, note, RELIABLE_QOS)
    process = _start_graph(speed, seed, domain)
    try:
        if not serve_until(lambda: len(ticks) > 1, _UP_S):
            raise GoalreachError(f'the graph did not tick within {_UP_S:.0f} s')
        serve_until(lambda: False, _SETTLE_S)
        ticks.clear()
        serve_until(lambda: False, seconds)
    finally:
        output = _end(process)
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()
    return _rate(ticks, output)


def _start_graph(speed: float, seed: int, domain: int) -> subprocess.Popen[str]:
    command = [sys.executable, '-m', 'goalreach_bringup.cli', 'run', '--speed', str(speed)]
    return subprocess.Popen(
        [*command, '--seed', str(seed)],
        env={**os.environ, 'ROS_DOMAIN_ID': str(domain), 'NO_COLOR': '1'},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def _end(process: subprocess.Popen[str]) -> str:
    process.terminate()
    try:
        return process.communicate(timeout=_END_S)[0]
    except subprocess.TimeoutExpired:
        process.kill()
        return process.communicate()[0]


def _rate(ticks: list[tuple[float, int]], output: str) -> ClockRate:
    if len(ticks) < 2:  # noqa: PLR2004 - a rate is of two ticks at least
        raise GoalreachError(f'the graph stopped ticking: {output.strip().splitlines()[-1:]}')
    (began_s, first_ns), (ended_s, last_ns) = ticks[0], ticks[-1]
    said = [float(text) for text in _SAID.findall(output)]
    return ClockRate(
        measured=(last_ns - first_ns) * 1e-9 / (ended_s - began_s),
        said=statistics.mean(said) if said else None,
        ticks=len(ticks),
    )
