"""Statistics of arriving messages over a sliding window, as `ros2 topic` words them."""

from collections import deque
import statistics

_NS = 1e-9
_UNITS = ((1e3, 1.0, '{:.0f} B'), (1e6, 1e3, '{:.2f} KB'), (float('inf'), 1e6, '{:.2f} MB'))
"""Bandwidth below which a unit is used, its bytes, and its text."""


class TimeWindow:
    """Collects intervals between arrivals, or delays of messages.

    Args:
        window: Number of times to keep, at least 1.
        delays: Whether `add` is to keep the delay in place of the interval.
    """

    def __init__(self, window: int, *, delays: bool = False) -> None:
        self._times_ns: deque[int] = deque(maxlen=window)
        self._delays = delays
        self._last_ns: int | None = None

    def add(self, now_ns: int, stamp_ns: int = 0) -> None:
        """Add an arrival; the first one, and one before the last, clear the window.

        Args:
            now_ns: Its time.
            stamp_ns: Stamp of the message.
        """
        if self._last_ns is None or now_ns < self._last_ns:
            self._times_ns.clear()
        else:
            self._times_ns.append(now_ns - (stamp_ns if self._delays else self._last_ns))
        self._last_ns = now_ns

    def __str__(self) -> str:
        """Return the two lines of `ros2 topic hz` or `delay`; empty where there is nothing."""
        if not self._times_ns:
            return ''
        times_s = [time_ns * _NS for time_ns in self._times_ns]
        mean_s = statistics.fmean(times_s)
        rate_hz = 1.0 / mean_s if mean_s else 0.0
        return (
            f'average {f"delay: {mean_s:.3f}" if self._delays else f"rate: {rate_hz:.3f}"}\n'
            f'\tmin: {min(times_s):.3f}s max: {max(times_s):.3f}s '
            f'std dev: {statistics.pstdev(times_s):.5f}s window: {len(times_s)}'
        )


class Bandwidth:
    """Collects sizes of messages.

    Args:
        window: Number of messages to keep, at least 1.
    """

    def __init__(self, window: int) -> None:
        self._arrivals: deque[tuple[float, int]] = deque(maxlen=window)

    def add(self, now_s: float, size: int) -> None:
        """Add an arrival of a message of some bytes."""
        self._arrivals.append((now_s, size))

    def text(self, now_s: float) -> str:
        """Return the two lines of `ros2 topic bw`; empty before the second arrival."""
        if len(self._arrivals) <= 1 or now_s <= self._arrivals[0][0]:
            return ''
        sizes = [size for _, size in self._arrivals]
        per_s = sum(sizes) / (now_s - self._arrivals[0][0])
        unit, text = next((unit, text) for limit, unit, text in _UNITS if per_s < limit)
        values = (per_s, sum(sizes) / len(sizes), min(sizes), max(sizes))
        rate, mean, least, most = (text.format(value / unit) for value in values)
        counted = f'{rate}/s from {len(sizes)} messages'
        return f'{counted}\n\tMessage size mean: {mean} min: {least} max: {most}'
