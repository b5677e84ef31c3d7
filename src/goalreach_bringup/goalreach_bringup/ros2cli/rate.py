"""Rate of arriving messages over a sliding window."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
import math

_NS = 1e-9


@dataclass(frozen=True, kw_only=True)
class RateSummary:
    """Statistics of the intervals between arrivals.

    Attributes:
        rate_hz: Reciprocal of the mean interval; zero where all intervals are zero.
        min_s: Shortest interval.
        max_s: Longest interval.
        std_dev_s: Standard deviation of the intervals (of the population).
        window: Number of intervals.
    """

    rate_hz: float
    min_s: float
    max_s: float
    std_dev_s: float
    window: int

    def __str__(self) -> str:
        """Return the two lines of `ros2 topic hz`."""
        return (
            f'average rate: {self.rate_hz:.3f}\n'
            f'\tmin: {self.min_s:.3f}s max: {self.max_s:.3f}s '
            f'std dev: {self.std_dev_s:.5f}s window: {self.window}'
        )


class ArrivalRate:
    """Collects arrival times of messages.

    Args:
        window: Number of intervals to keep, at least 1.
    """

    def __init__(self, window: int) -> None:
        self._intervals_ns: deque[int] = deque(maxlen=window)
        self._last_ns: int | None = None

    def add(self, now_ns: int) -> None:
        """Add an arrival. A clock that jumps back clears the window."""
        if self._last_ns is not None:
            if now_ns < self._last_ns:
                self._intervals_ns.clear()
            else:
                self._intervals_ns.append(now_ns - self._last_ns)
        self._last_ns = now_ns

    def summary(self) -> RateSummary | None:
        """Return the statistics of the window, None before the second arrival."""
        if not self._intervals_ns:
            return None
        count = len(self._intervals_ns)
        mean_ns = sum(self._intervals_ns) / count
        variance = sum((interval - mean_ns) ** 2 for interval in self._intervals_ns) / count
        return RateSummary(
            rate_hz=1.0 / (mean_ns * _NS) if mean_ns > 0 else 0.0,
            min_s=min(self._intervals_ns) * _NS,
            max_s=max(self._intervals_ns) * _NS,
            std_dev_s=math.sqrt(variance) * _NS,
            window=count,
        )
