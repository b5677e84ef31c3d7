"""The clock of a running graph: polled at next to no cost, and compared with the wall clock."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from pathlib import Path
import re
import tempfile
import time
from typing import Final

import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from goalreach_dashboard.ros.subscriptions import PolledSubscription, best_effort
from goalreach_lab.rigs.stack import Stack, free_domains
from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, use_profile
from goalreach_msgs_py.topics import CLOCK
from goalreach_sim.pacing import REPORT_S

_POLL_S: Final = 0.05
_SAMPLE_S: Final = 0.01
_UP_S: Final = 30.0
_SETTLE_S: Final = 2.0
_REPORTED: Final = re.compile(r'too slow: ([\d.]+) times real time')


class RunClock:
    """The clock of the graph in a domain; only its newest tick is kept, and taken on demand.

    Args:
        domain: ROS domain.
    """

    def __init__(self, domain: int) -> None:
        """Join the graph."""
        use_profile(fast_dds_profile())
        self._context = Context()
        rclpy.init(args=[], context=self._context, domain_id=domain)
        self._node = Node('run_clock', context=self._context, enable_rosout=False)
        self._subscription = PolledSubscription(self._node, Clock, CLOCK, best_effort(1))
        self._now_s = 0.0

    def now_s(self) -> float:
        """Return simulated seconds by the newest tick; 0 before the first."""
        for raw in self._subscription.take():
            self._now_s = stamp_of(raw) * 1e-9
        return self._now_s

    def wait_until(self, clock_s: float, limit_s: float) -> None:
        """Wait until the clock shows a time.

        Raises:
            GoalreachError: It does not, within so many seconds of the wall clock.
        """
        deadline_s = time.monotonic() + limit_s
        while self.now_s() < clock_s:
            if time.monotonic() > deadline_s:
                raise GoalreachError(f'the clock of the graph stands at {self._now_s:.1f} s')
            time.sleep(_POLL_S)

    def close(self) -> None:
        """Leave the graph."""
        self._node.destroy_node()
        self._context.try_shutdown()


@dataclass(frozen=True, kw_only=True)
class ClockRate:
    """The rate of a graph's clock.

    Attributes:
        measured: Simulated seconds per wall second, from `/clock`.
        reported: The same as the simulator reports it: the requested speed, and for the time of
            a reported shortfall the speed of that report.
        ticks: Ticks behind the figure.
    """

    measured: float
    reported: float
    ticks: int


def measure_clock_rate(speed: float, seconds: float, seed: int) -> ClockRate:
    """Run the graph and compare its clock with the wall clock.

    Args:
        speed: Requested simulated seconds per wall second.
        seconds: Duration of the measurement, after the graph has settled, s.
        seed: Seed of the run.

    Raises:
        GoalreachError: The graph did not come up.
    """
    reports: list[tuple[float, float]] = []

    def on_line(line: str) -> None:
        found = _REPORTED.search(line)
        if found:
            reports.append((time.monotonic(), float(found[1])))

    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        domain = free_domains(1)[0]
        clock = RunClock(domain)
        words = ['--no-dashboard', '--speed', str(speed), '--seed', str(seed)]
        stack = Stack(words, domain=domain, log_directory=Path(folder), on_line=on_line)
        try:
            clock.wait_until(0.1, _UP_S)
            time.sleep(_SETTLE_S)
            ticks = _sample(clock, seconds)
        finally:
            stack.stop()
            clock.close()
    return clock_rate(ticks, reports, speed)


def _sample(clock: RunClock, seconds: float) -> list[tuple[float, float]]:
    """Return wall and simulated time, s, of the ticks seen for some time."""
    ticks: list[tuple[float, float]] = []
    deadline_s = time.monotonic() + seconds
    while time.monotonic() < deadline_s:
        now_s = clock.now_s()
        if not ticks or now_s > ticks[-1][1]:
            ticks.append((time.monotonic(), now_s))
        time.sleep(_SAMPLE_S)
    return ticks


def clock_rate(
    ticks: Sequence[tuple[float, float]], reports: Sequence[tuple[float, float]], speed: float
) -> ClockRate:
    """Return the rate over whole spans of the simulator's reports, which follow one another.

    Args:
        ticks: Wall and simulated time of ticks, s.
        reports: Wall time, s, and reported speed of shortfalls; each is about the `REPORT_S`
            seconds before it.
        speed: Requested speed.

    Raises:
        GoalreachError: There are fewer than two ticks.
    """
    if len(ticks) < 2:  # noqa: PLR2004 - a rate is of two ticks at least
        raise GoalreachError('the graph stopped ticking')
    walls_s, sims_s = zip(*ticks, strict=True)
    began_s, ended_s = walls_s[0], walls_s[-1]
    reports = [report for report in reports if began_s + REPORT_S <= report[0] <= ended_s]
    if reports:
        first_s, last_s = reports[0][0], reports[-1][0]
        began_s = first_s - REPORT_S * math.floor((first_s - began_s) / REPORT_S)
        ended_s = last_s + REPORT_S * math.floor((ended_s - last_s) / REPORT_S)
    passed_s = float(np.diff(np.interp([began_s, ended_s], walls_s, sims_s))[0])
    lost_s = sum(REPORT_S * (speed - reported) for _, reported in reports)
    return ClockRate(
        measured=passed_s / (ended_s - began_s),
        reported=speed - lost_s / (ended_s - began_s),
        ticks=len(ticks),
    )
