from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_bringup.ros2cli.rate import Bandwidth, TimeWindow

MS = 1_000_000


def test_statistics_of_three_intervals() -> None:
    rate = TimeWindow(10)
    for arrival_ms in (1000, 1100, 1200, 1500):  # intervals of 100, 100 and 300 ms
        rate.add(arrival_ms * MS)
    assert str(rate) == (  # sqrt((2 * 66.7^2 + 133.3^2) / 3) ms
        'average rate: 6.000\n\tmin: 0.100s max: 0.300s std dev: 0.09428s window: 3'
    )


def test_statistics_of_delays_begin_with_the_second_message() -> None:
    delays = TimeWindow(10, delays=True)
    for arrival_ms, stamp_ms in ((1000, 0), (1100, 1000), (1200, 1100), (1500, 1200)):
        delays.add(arrival_ms * MS, stamp_ms * MS)
    assert str(delays) == (  # 100, 100 and 300 ms
        'average delay: 0.167\n\tmin: 0.100s max: 0.300s std dev: 0.09428s window: 3'
    )


def test_window_forgets_the_oldest() -> None:
    rate = TimeWindow(2)
    for arrival_ms in (0, 1000, 1100, 1200):
        rate.add(arrival_ms * MS)
    assert str(rate).startswith('average rate: 10.000\n')
    assert str(rate).endswith('window: 2')


def test_clock_that_went_back_starts_anew() -> None:
    rate = TimeWindow(5)
    for arrival_ms in (5000, 5100, 100):
        rate.add(arrival_ms * MS)
    assert str(rate) == ''
    rate.add(600 * MS)
    assert str(rate).startswith('average rate: 2.000\n')


def test_nothing_to_say_before_the_second_arrival() -> None:
    rate = TimeWindow(5)
    assert str(rate) == ''
    rate.add(1)
    assert str(rate) == ''


@pytest.mark.parametrize(
    ('size', 'rate', 'sizes'),
    [
        (10, '60 B', '20 B min: 10 B max: 30 B'),
        (1000, '6.00 KB', '2.00 KB min: 1.00 KB max: 3.00 KB'),
        (10**6, '6.00 MB', '2.00 MB min: 1.00 MB max: 3.00 MB'),
    ],
)
def test_bandwidth_chooses_the_unit(size: int, rate: str, sizes: str) -> None:
    bandwidth = Bandwidth(3)
    for number in range(4):
        bandwidth.add(float(number), number * size)  # the first falls out of the window
    assert bandwidth.text(2.0) == f'{rate}/s from 3 messages\n\tMessage size mean: {sizes}'
    assert bandwidth.text(1.0) == ''


@given(st.lists(st.integers(0, 10**10), min_size=2, max_size=30), st.integers(1, 10))
def test_mean_lies_between_the_extremes(arrivals_ns: list[int], window: int) -> None:
    rate = TimeWindow(window)
    for arrival_ns in sorted(arrivals_ns):
        rate.add(arrival_ns)
    numbers = [float(text) for text in re.findall(r'\d+\.?\d*', str(rate))]
    rate_hz, least_s, most_s, _, count = numbers
    assert count == min(window, len(arrivals_ns) - 1)
    if rate_hz > 0:
        assert least_s - 0.001 <= 1.0 / (rate_hz - 0.0005 if rate_hz > 0.001 else rate_hz)
        assert 1.0 / (rate_hz + 0.0005) <= most_s + 0.001
