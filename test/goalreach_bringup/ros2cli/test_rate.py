from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_bringup.ros2cli.rate import ArrivalRate

MS = 1_000_000


def test_statistics_of_three_intervals() -> None:
    rate = ArrivalRate(window=10)
    for arrival_ms in (1000, 1100, 1200, 1500):  # intervals of 100, 100 and 300 ms
        rate.add(arrival_ms * MS)
    summary = rate.summary()
    assert summary is not None
    assert summary.rate_hz == pytest.approx(6.0)
    assert (summary.min_s, summary.max_s) == pytest.approx((0.1, 0.3))
    assert summary.std_dev_s == pytest.approx(0.0942809)  # sqrt((2 * 66.7^2 + 133.3^2) / 3) ms
    assert str(summary) == (
        'average rate: 6.000\n\tmin: 0.100s max: 0.300s std dev: 0.09428s window: 3'
    )


def test_window_forgets_the_oldest() -> None:
    rate = ArrivalRate(window=2)
    for arrival_ms in (0, 1000, 1100, 1200):
        rate.add(arrival_ms * MS)
    summary = rate.summary()
    assert summary is not None
    assert summary.window == 2
    assert summary.rate_hz == pytest.approx(10.0)


def test_clock_that_went_back_starts_anew() -> None:
    rate = ArrivalRate(window=5)
    for arrival_ms in (5000, 5100, 100):
        rate.add(arrival_ms * MS)
    assert rate.summary() is None
    rate.add(600 * MS)
    summary = rate.summary()
    assert summary is not None
    assert summary.rate_hz == pytest.approx(2.0)


def test_nothing_to_say_before_the_second_arrival() -> None:
    rate = ArrivalRate(window=5)
    assert rate.summary() is None
    rate.add(1)
    assert rate.summary() is None


@given(st.lists(st.integers(0, 10**10), min_size=2, max_size=30), st.integers(1, 10))
def test_mean_lies_between_the_extremes(arrivals_ns: list[int], window: int) -> None:
    rate = ArrivalRate(window)
    for arrival_ns in sorted(arrivals_ns):
        rate.add(arrival_ns)
    summary = rate.summary()
    assert summary is not None
    assert summary.window == min(window, len(arrivals_ns) - 1)
    if summary.rate_hz > 0:
        assert summary.min_s * 0.999999 <= 1.0 / summary.rate_hz <= summary.max_s * 1.000001
