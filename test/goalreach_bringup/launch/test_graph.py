"""Spacing restarts out."""

from goalreach_bringup.launch.graph import Backoff


def test_waits_not_at_all_then_twice_as_long_each_time_and_gives_up() -> None:
    backoff = Backoff(first_delay_s=0.5, limit=4, window_s=60.0)
    assert [backoff.died(t) for t in (1.0, 2.0, 3.0, 4.0)] == [0.0, 0.5, 1.0, None]


def test_old_deaths_are_forgiven() -> None:
    backoff = Backoff(first_delay_s=0.5, limit=3, window_s=10.0)
    assert [backoff.died(t) for t in (0.0, 5.0, 11.0, 30.0)] == [0.0, 0.5, 0.5, 0.0]
