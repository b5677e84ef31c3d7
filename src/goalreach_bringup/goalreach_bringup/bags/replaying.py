"""What a replay is asked to be."""

from __future__ import annotations

from dataclasses import dataclass
import math
from pathlib import Path

from goalreach_bringup.bags.selection import TopicSelection
from goalreach_msgs_py.errors import ConfigurationError

__all__ = ['ReplayOptions']


@dataclass(frozen=True, kw_only=True)
class ReplayOptions:
    """Options of a replay.

    Attributes:
        path: The bag.
        selection: Which topics.
        rate: Seconds of the bag per second of the wall clock.
        loop: Whether to begin again at the end.
        start_s: Where to begin, seconds after the first message.
        duration_s: How much to play, seconds of the bag; all if None.
        clock: Whether to publish `/clock`.
        paused: Whether to begin with a pause.
        delay_s: Wall seconds for subscribers to connect before the first message.
        quiet: Whether to show no progress.
    """

    path: Path
    selection: TopicSelection
    rate: float = 1.0
    loop: bool = False
    start_s: float = 0.0
    duration_s: float | None = None
    clock: bool = False
    paused: bool = False
    delay_s: float = 0.5
    quiet: bool = False

    def __post_init__(self) -> None:
        """Check what argparse cannot."""
        if not (self.rate > 0.0 and math.isfinite(self.rate)):
            raise ConfigurationError('--rate', self.rate, 'greater than 0')
        if not self.start_s >= 0.0:
            raise ConfigurationError('--start', self.start_s, 'at least 0')
        if self.duration_s is not None and not self.duration_s > 0.0:
            raise ConfigurationError('--duration', self.duration_s, 'greater than 0')
        if not self.delay_s >= 0.0:
            raise ConfigurationError('--delay', self.delay_s, 'at least 0')
