from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from goalreach_bringup.ros2cli.ros.traffic import ArrivalRate

MS = 1_000_000


def test_statistics_of_three_intervals() -> None:
    rate = ArrivalRate(10)
    for arrival_ms in (1000, 1100, 1200, 1500):  # intervals of 100, 100 and 300 ms
        rate.add(arrival_ms * MS)
    assert str(rate) == (  # sqrt((2 * 66.7^2 + 133.3^2) / 3) ms
        'average rate: 6.000\n\tmin: 0.100s max: 0.300s std dev: 0.09428s window: 3'
    )


def test_window_forgets_the_oldest() -> None:
    rate = ArrivalRate(2)
    for arrival_ms in (0, 1000, 1100, 1200):
        rate.add(arrival_ms * MS)
    assert str(rate).startswith('average rate: 10.000\n')
    assert str(rate).endswith('window: 2')


def test_clock_that_went_back_starts_anew() -> None:
    rate = ArrivalRate(5)
    for arrival_ms in (5000, 5100, 100):
        rate.add(arrival_ms * MS)
    assert str(rate) == ''
    rate.add(600 * MS)
    assert str(rate).startswith('average rate: 2.000\n')


def test_nothing_to_say_before_the_second_arrival() -> None:
    rate = ArrivalRate(5)
    assert str(rate) == ''
    rate.add(1)
    assert str(rate) == ''


@given(st.lists(st.integers(0, 10**10), min_size=2, max_size=30), st.integers(1, 10))
def test_mean_lies_between_the_extremes(arrivals_ns: list[int], window: int) -> None:
    rate = ArrivalRate(window)
    for arrival_ns in sorted(arrivals_ns):
        rate.add(arrival_ns)
    numbers = [float(text) for text in re.findall(r'\d+\.?\d*', str(rate))]
    rate_hz, least_s, most_s, _, count = numbers
    assert count == min(window, len(arrivals_ns) - 1)
    if rate_hz > 0:
        assert least_s - 0.001 <= 1.0 / (rate_hz - 0.0005 if rate_hz > 0.001 else rate_hz)
        assert 1.0 / (rate_hz + 0.0005) <= most_s + 0.001
