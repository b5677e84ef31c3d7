"""Ticks kept in little room."""

import tracemalloc

import pytest

from goalreach_bringup.launch.tick_log import Tick, TickLog
from goalreach_msgs_py.values import Pose2


def pose(value: float) -> Pose2:
    return Pose2(x_m=value, y_m=value + 0.25, heading_rad=value + 0.5)


def ticks(count: int) -> list[Tick]:
    """Return ticks 40 ms apart, each third without an estimate, each fourth without a heading."""
    return [
        Tick(
            time_ns=40_000_000 * number,
            truth=pose(number),
            estimate=pose(number + 0.125) if number % 3 else None,
            commanded_heading_rad=0.1 * number if number % 4 else None,
        )
        for number in range(count)
    ]


def log_of(written: list[Tick]) -> TickLog:
    log = TickLog()
    for tick in written:
        log.append(tick)
    return log


def test_what_goes_in_comes_out() -> None:
    written = ticks(13)
    log = log_of(written)
    assert len(log) == 13
    assert list(log) == written
    assert log[-1] == written[-1]
    assert list(log[4:9]) == written[4:9]
    with pytest.raises(IndexError):
        log[13]
    with pytest.raises(ValueError, match='steps of 1, not 2'):
        log[::2]


@pytest.mark.parametrize(
    ('time_ns', 'taken'),
    [(-1, 0), (0, 1), (79_999_999, 2), (80_000_000, 3), (10**12, 5)],
)
def test_ticks_up_to_a_stamp_are_taken_out(time_ns: int, taken: int) -> None:
    written = ticks(5)
    log = log_of(written)
    assert list(log.take_until(time_ns)) == written[:taken]
    assert list(log) == written[taken:]


def test_a_long_path_takes_little_room() -> None:
    tracemalloc.start()
    try:
        log = log_of(ticks(3000))
        held_bytes, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert held_bytes < 100 * len(log)
