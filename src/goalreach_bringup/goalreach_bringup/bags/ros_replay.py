"""A replay as a process: from its options to its end."""

from __future__ import annotations

import os
import time
from typing import Final

import rclpy
from rclpy.signals import SignalHandlerOptions

from goalreach_bringup.bags.bag_reader_file import BagReader
from goalreach_bringup.bags.keyboard import Keyboard
from goalreach_bringup.bags.replaying import ReplayOptions
from goalreach_bringup.bags.ros_player import Player
from goalreach_bringup.run.environment import fast_dds_profile
from goalreach_bringup.terminal import progress_bar
from goalreach_msgs_py.ros_node import StopRequest

__all__ = ['replay']

_PROFILES: Final = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_MS: Final = 1_000_000


def replay(options: ReplayOptions) -> str:
    """Replay a bag; return a line that says what was done.

    Raises:
        GoalreachError: The bag cannot be read, or holds nothing to replay.
    """
    stop = StopRequest()
    with BagReader(options.path) as bag:
        os.environ.setdefault(_PROFILES, fast_dds_profile())
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        player = None
        try:
            player = Player(bag, options)
            return _play(player, options, stop)
        finally:
            if player is not None:
                player.destroy_node()
            rclpy.try_shutdown()


def _play(player: Player, options: ReplayOptions, stop: StopRequest) -> str:
    keyboard = Keyboard()
    label = 'replay (space: pause, s: step, up/down: rate, q: end)'
    began_s = time.monotonic()
    total = player.duration_ns // _MS
    with (
        keyboard.listening(),
        progress_bar(label, total=total, quiet=options.quiet or options.loop) as advance,
    ):
        sent = player.play(
            lambda: stop.requested, keyboard.key, lambda passed_ns: advance(passed_ns // _MS)
        )
    return f'replayed {sent} messages in {time.monotonic() - began_s:.1f} s: {options.path}'
