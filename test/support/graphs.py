"""Real graphs for tests: the stack as a person starts it, and a node that looks on."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
import contextlib
from contextlib import contextmanager
import itertools
import os
from pathlib import Path
import re
import socket
import subprocess
import sys
import time
from typing import Any

import psutil
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from goalreach_msgs_py.ros.dds_profile import (
    count_local_participants,
    fast_dds_profile,
    use_profile,
)

_DOMAINS = itertools.count()
_CLAIMS: deque[socket.socket] = deque()
_KEPT_CLAIMS = 10  # more than one test, and the fixtures of its module, use
_LOWEST_DOMAIN = 20
_DOMAIN_SPAN = 80
_END_S = 10.0


def fresh_domain() -> int:
    """Return a ROS_DOMAIN_ID that nobody on this machine uses.

    An abstract socket for each of the last numbers keeps other tests from taking them.
    """
    for _ in range(_DOMAIN_SPAN):
        domain = _LOWEST_DOMAIN + (os.getpid() * 7 + next(_DOMAINS)) % _DOMAIN_SPAN
        if count_local_participants(domain):
            continue
        claim = socket.socket(socket.AF_UNIX)
        try:
            claim.bind(f'\0goalreach-test-domain-{domain}')
        except OSError:
            claim.close()
            continue
        _CLAIMS.append(claim)
        if len(_CLAIMS) > _KEPT_CLAIMS:
            _CLAIMS.popleft().close()
        return domain
    raise RuntimeError('all domains are used: wait for those of another start')


def join(domain: int, context: Context | None = None) -> None:
    """Initialize rclpy in a domain, on loopback alone.

    Fast DDS reads its profile once: the first participant decides for all tests of its process.
    """
    use_profile(fast_dds_profile())
    rclpy.init(args=[], context=context, domain_id=domain)


def graph_environment(domain: int, home: Path) -> dict[str, str]:
    """Return the environment of a process of the test's own graph."""
    return {
        **os.environ,
        'ROS_DOMAIN_ID': str(domain),
        'ROS_LOG_DIR': str(home),
        'ROS_PYTHON_CHECK_FIELDS': '1',
        'NO_COLOR': '1',
    }


@contextmanager
def goalreach(arguments: list[str], *, domain: int, home: Path) -> Iterator[subprocess.Popen[str]]:
    """Run `goalreach` in a process of its own and end it, whatever happens."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'goalreach_bringup.cli', *arguments],
        env=graph_environment(domain, home),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
        try:
            process.communicate(timeout=_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            raise


@contextmanager
def onlooker(domain: int) -> Iterator[tuple[Node, Callable[[Callable[[], bool], float], bool]]]:
    """Give a node in a domain, and a function that serves it until a condition holds.

    The function takes the condition and a time limit in seconds and returns whether it held.
    """
    context = Context()
    join(domain, context)
    node = Node('onlooker', context=context, enable_rosout=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def serve_until(condition: Callable[[], bool], limit_s: float) -> bool:
        deadline_s = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > deadline_s:
                return False
            executor.spin_once(timeout_sec=0.05)
        return True

    try:
        yield node, serve_until
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()


def shared_memory_of(pid: int) -> set[Path]:
    """Return the files of Fast DDS that a process and its descendants have mapped."""
    family = [pid]
    with contextlib.suppress(psutil.NoSuchProcess):
        family += [child.pid for child in psutil.Process(pid).children(recursive=True)]
    return _mapped(family)


def abandoned(files: set[Path]) -> set[Path]:
    """Return which of some files still exist though no process uses them.

    Ports below those of domain 0 are left out: the processes of all domains share them.
    """
    shared = {path for path in files if re.search(r'port[0-7]\d{3}(_\w+)?$', path.name)}
    return {path for path in files - shared if path.exists()} - _mapped(psutil.pids())


def _mapped(pids: list[int]) -> set[Path]:
    found: set[Path] = set()
    for pid in pids:
        with contextlib.suppress(OSError):
            text = Path(f'/proc/{pid}/maps').read_text()
            found.update(map(Path, re.findall(r'/dev/shm/\S*fastrtps_\S+', text)))  # noqa: S108
    return found


def collect(
    node: Node, message_type: type[object], topic: str, qos: QoSProfile, into: list[Any]
) -> None:
    """Append every message of a topic to a list."""
    node.create_subscription(message_type, topic, into.append, qos)
