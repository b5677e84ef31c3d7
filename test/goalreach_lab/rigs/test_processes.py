"""Processes as the kernel shows them: this one, and a child with a name and a socket."""

from __future__ import annotations

from collections.abc import Iterator
import os
import subprocess
import sys

import psutil
import pytest

from goalreach_lab.rigs.processes import (
    CpuMeter,
    cpu_time_s,
    descendants_of,
    find_descendant,
    holdings_of,
    processes_with,
    proportional_mb,
)
from listeners import listeners_of

NO_PID = 2**22 + 1
CHILD = """
import ctypes
import socket
ctypes.CDLL(None).prctl(15, b'landmark_localizer')  # PR_SET_NAME
udp = socket.socket(type=socket.SOCK_DGRAM)
udp.bind(('127.0.0.1', 0))
print(udp.getsockname()[1], flush=True)
input()
"""


@pytest.fixture
def child() -> Iterator[tuple[int, int]]:
    """Start a process that calls itself a node; yield its process id and its port."""
    process = subprocess.Popen(
        [sys.executable, '-c', CHILD],
        env={**os.environ, 'MARK': f'of {os.getpid()}'},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    port = int(process.stdout.readline())
    yield process.pid, port
    process.communicate('\n', timeout=10.0)


def test_a_child_is_found_by_its_name_and_environment(child: tuple[int, int]) -> None:
    pid, _ = child
    assert pid in descendants_of(os.getpid())
    assert find_descendant(os.getpid(), 'landmark_localizer') == pid
    assert find_descendant(os.getpid(), 'nomad200') is None
    assert processes_with('MARK', f'of {os.getpid()}') == [pid]


def test_a_child_holds_memory_threads_and_handles(child: tuple[int, int]) -> None:
    held = holdings_of(child[0])
    assert held is not None
    assert held.name == 'landmark_localizer'
    assert 1.0 < held.memory_mb < 1000.0
    assert held.threads >= 1
    assert held.handles >= 4


def test_a_child_listens_on_loopback(child: tuple[int, int]) -> None:
    pid, port = child
    (one,) = [listener for listener in listeners_of(pid) if listener.port == port]
    assert (one.protocol, one.address, one.is_loopback) == ('udp', '127.0.0.1', True)


def test_the_proportional_set_size_is_less_than_the_resident_one() -> None:
    resident_mb = psutil.Process().memory_info().rss / 1e6
    assert 0.0 < proportional_mb([os.getpid()]) < 1.01 * resident_mb


def test_processor_time_is_that_of_this_process() -> None:
    before_s, meter = cpu_time_s(os.getpid()), CpuMeter([os.getpid()])
    # One tick of the kernel's clock more than is asserted: sums and differences of floats differ.
    while cpu_time_s(os.getpid()) < before_s + 0.06:
        pass
    assert meter.used_s >= 0.05
    assert 0.0 < meter.cores < 2.0


def test_what_has_ended_holds_nothing() -> None:
    assert cpu_time_s(NO_PID) == 0.0
    assert holdings_of(NO_PID) is None
    assert listeners_of(NO_PID) == []
    assert descendants_of(NO_PID) == []
    assert proportional_mb([NO_PID]) == 0.0
