"""A recording as a process: from its options to its end."""

from __future__ import annotations

import os
from pathlib import Path
import time
from typing import Final

import rclpy
from rclpy.signals import SignalHandlerOptions
from rich.console import Console
from rich.status import Status

from goalreach_bringup.bags.recording import RecordingResult, RecordOptions
from goalreach_bringup.bags.ros_recorder import Recorder
from goalreach_msgs_py.ros_node import StopRequest, end_with_launcher

__all__ = ['record']

_PROFILES: Final = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_DISCOVERY: Final = Path(__file__).parents[1] / 'config' / 'fastdds_discovery.xml'


def record(options: RecordOptions) -> RecordingResult:
    """Record until SIGINT or SIGTERM, or until the time is over.

    Raises:
        BagError: The bag cannot be made.
    """
    end_with_launcher()
    stop = StopRequest()
    os.environ.setdefault(_PROFILES, str(_DISCOVERY))
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    began_s = time.monotonic()

    def is_over() -> bool:
        limit_s = options.duration_s
        return stop.requested or (limit_s is not None and time.monotonic() - began_s >= limit_s)

    console = Console(stderr=True)
    status = Status('recording', console=console)
    if console.is_terminal:
        status.start()
    recorder = None
    try:
        recorder = Recorder(options)
        return recorder.record(is_over, status.update)
    finally:
        status.stop()
        if recorder is not None:
            recorder.destroy_node()
        rclpy.try_shutdown()
