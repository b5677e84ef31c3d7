"""How fast the clock of a running graph really runs, and what the graph says about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
import os
import re
import subprocess
import sys
import threading
import time

import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from goalreach_lab.rigs.stack import wait_or_kill
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.common_messages import stamp_from_msg
from goalreach_msgs_py.ros.subscribe_raw import RELIABLE_QOS
from goalreach_msgs_py.topics import CLOCK
from goalreach_sim.pacing import REPORT_S

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
        told: The same by the simulator's words: what it was asked for, but where it told of a
            shortfall what it told.
        ticks: Ticks behind the figure.
    """

    measured: float
    told: float
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
    words: list[tuple[float, float]] = []
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
    reader = threading.Thread(target=_read, args=(process, words), daemon=True)
    reader.start()
    try:
        if not serve_until(lambda: len(ticks) > 1, _UP_S):
            raise GoalreachError(f'the graph did not tick within {_UP_S:.0f} s')
        serve_until(lambda: False, _SETTLE_S)
        ticks.clear()
        serve_until(lambda: False, seconds)
    finally:
        _end(process)
        reader.join(_END_S)
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()
    return _rate(ticks, words, speed)


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


def _read(process: subprocess.Popen[str], words: list[tuple[float, float]]) -> None:
    """Note when the graph told of a shortfall, and which speed it told."""
    for line in process.stdout or ():
        said = _SAID.search(line)
        if said:
            words.append((time.monotonic(), float(said[1])))


def _end(process: subprocess.Popen[str]) -> None:
    process.terminate()
    wait_or_kill(process, _END_S)


def _rate(
    ticks: list[tuple[float, int]], words: list[tuple[float, float]], speed: float
) -> ClockRate:
    """Compare over whole spans of the simulator's reports, which follow one another."""
    if len(ticks) < 2:  # noqa: PLR2004 - a rate is of two ticks at least
        raise GoalreachError('the graph stopped ticking')
    walls_s, stamps_ns = zip(*ticks, strict=True)
    began_s, ended_s = walls_s[0], walls_s[-1]
    words = [word for word in words if began_s + REPORT_S <= word[0] <= ended_s]
    if words:
        first_s, last_s = words[0][0], words[-1][0]
        began_s = first_s - REPORT_S * math.floor((first_s - began_s) / REPORT_S)
        ended_s = last_s + REPORT_S * math.floor((ended_s - last_s) / REPORT_S)
    passed_s = np.diff(np.interp([began_s, ended_s], walls_s, stamps_ns))[0] * 1e-9
    lost_s = sum(REPORT_S * (speed - told) for _, told in words)
    return ClockRate(
        measured=float(passed_s) / (ended_s - began_s),
        told=speed - lost_s / (ended_s - began_s),
        ticks=len(ticks),
    )
