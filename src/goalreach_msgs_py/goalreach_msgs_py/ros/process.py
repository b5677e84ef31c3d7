"""The process of a node: signals, garbage collection, memory, name, and an end with its launcher.

Imports nothing of ROS: a command, and a process before its `main`, need no rclpy for it.
"""

import ctypes
import gc
import os
import signal
from types import FrameType

LAUNCHER_PID = 'GOALREACH_LAUNCHER_PID'
"""Environment variable by which a launcher asks its nodes to end when it dies."""

_GC_PERIOD_S = 10.0
"""Time between full collections. Chosen."""
_PR_SET_PDEATHSIG = 1
_PR_SET_NAME = 15
_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3
_LARGEST_KEPT_BYTES = 16 << 20
_MOST_KEPT_BYTES = 64 << 20
"""Sizes for `mallopt`. Chosen: a few images of the largest camera that the parameters allow."""


class StopRequest:
    """Turns SIGINT and SIGTERM into a flag that a main loop checks; notes which one came."""

    def __init__(self) -> None:
        self.requested = False
        self.signal = 0
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        self.requested, self.signal = True, number


class PeriodicGc:
    """Runs a full garbage collection every 10 s, in a loop that never triggers one.

    Only a full collection returns the tuples that Python keeps for reuse, up to 2000 of each
    length. Where all objects are freed by their reference counts none is ever triggered, and over
    hours the process grows by some megabytes. Times are those of a monotonic clock.
    """

    def __init__(self, now_s: float) -> None:
        """Exclude all objects that exist by now from later collections."""
        gc.freeze()
        gc.enable()
        self._due_s = now_s + _GC_PERIOD_S

    def collect_if_due(self, now_s: float) -> None:
        """Collect where it is due; to be called in every iteration of the loop."""
        if now_s < self._due_s:
            return
        gc.collect()
        self._due_s = now_s + _GC_PERIOD_S


def keep_freed_memory() -> None:
    """Make the allocator (glibc) keep freed blocks of an image's size.

    By default it returns each to the kernel, and the next image causes a page fault for each of
    its pages, which costs twenty times as much as copying the image.
    """
    mallopt = getattr(ctypes.CDLL(None), 'mallopt', None)
    if mallopt is not None:
        mallopt(_M_MMAP_THRESHOLD, _LARGEST_KEPT_BYTES)
        mallopt(_M_TRIM_THRESHOLD, _MOST_KEPT_BYTES)


def set_process_name(name: str) -> None:
    """Set the name of this process in `ps -C` and `top`, at most 15 letters (Linux)."""
    ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode())


def terminate_with_launcher() -> None:
    """Request SIGTERM from the kernel when the launcher dies, for whatever reason (Linux)."""
    launcher = os.environ.get(LAUNCHER_PID)
    if launcher is None:
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if str(os.getppid()) != launcher:
        raise SystemExit(0)
