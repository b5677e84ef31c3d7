from collections.abc import Iterator

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from goalreach_sim.ros.clocks import Pacer


def make(speed: float = 1.0) -> Pacer:
    return Pacer(period_s=0.04, speed=speed, now_s=100.0)


def run(pacer: Pacer, times_s: list[float]) -> Iterator[tuple[int, float | None]]:
    for time_s in times_s:
        yield pacer.ticks_due(time_s), pacer.shortfall(time_s)


def test_one_tick_in_each_interval() -> None:
    pacer = make(speed=2.0)
    assert pacer.interval_s == pytest.approx(0.02)
    due = [pacer.ticks_due(100.0 + 0.001 * ms) for ms in range(100)]
    assert [ms for ms, count in enumerate(due) if count] == pytest.approx(
        [0, 20, 40, 60, 80], abs=1
    )
    assert sum(due) == 5


def test_a_short_stall_is_made_up_for_a_few_ticks_at_a_time() -> None:
    pacer = make(speed=4.0)  # a tick every 10 ms
    pacer.ticks_due(100.0)
    # 0.2 s of silence: 20 ticks are missing, five come at a time.
    assert [pacer.ticks_due(100.2) for _ in range(5)] == [5, 5, 5, 5, 0]
    steady = [100.2 + 0.01 * k for k in range(1, 600)]
    assert all(said is None for _, said in run(pacer, steady))


def test_long_delays_are_skipped_and_reported() -> None:
    pacer = make()
    times_s = [100.0, *(102.0 + 0.04 * k for k in range(80))]
    results = list(run(pacer, times_s))
    # Two of the five seconds are lost: 3 s plus the first tick over 5 s.
    (real_speed,) = [said for _, said in results if said is not None]
    assert real_speed == pytest.approx(0.6, abs=0.02)
    assert max(count for count, _ in results) <= 2


def test_half_the_speed_is_reported() -> None:
    pacer = make(speed=50.0)  # 0.8 ms apart, while a tick takes 1.6 ms
    now_s, said = 100.0, []
    while now_s < 111.0:
        now_s += 0.0016 * max(1, pacer.ticks_due(now_s))
        said.append(pacer.shortfall(now_s))
    assert [value for value in said if value] == pytest.approx([25.0, 25.0], rel=0.02)


@pytest.mark.parametrize(('stalls', 'told'), [(0, False), (1, True)])
def test_reports_a_loss_of_more_than_two_percent(stalls: int, told: bool) -> None:  # noqa: FBT001
    # One stall of 0.32 s costs seven of the 125 ticks of a report: 5.6 percent.
    pacer = make()
    times_s = [100.0 + 0.04 * k + (0.32 * stalls if k > 50 else 0.0) for k in range(130)]
    said = [value for _, value in run(pacer, times_s) if value is not None]
    assert bool(said) == told
    if told:
        assert said == [pytest.approx(118 / 125, abs=0.01)]


def test_each_report_covers_its_own_interval() -> None:
    pacer = make()
    list(run(pacer, [100.0, 103.0]))
    assert pacer.shortfall(105.0) == pytest.approx(2 * 0.04 / 5.0)
    steady = [105.0 + 0.04 * k for k in range(1, 130)]
    reports = [said for _, said in run(pacer, steady)]
    # The first report after the stall still holds its end, the next holds none of it.
    assert len([value for value in reports if value is not None]) <= 1


@given(
    speed=st.sampled_from([0.25, 1.0, 4.0, 100.0]),
    waits_s=st.lists(st.floats(0.0, 0.24), min_size=1, max_size=200),
)
@settings(max_examples=50, deadline=None)
def test_lateness_within_bounds_loses_nothing(speed: float, waits_s: list[float]) -> None:
    pacer = make(speed)
    now_s, ticks = 100.0, 0
    for wait_s in waits_s:
        now_s += wait_s
        while count := pacer.ticks_due(now_s):
            assert count <= 5
            ticks += count
    assert ticks == pytest.approx((now_s - 100.0) / pacer.interval_s, abs=1.001)


@given(waits_s=st.lists(st.floats(0.0, 3.0), min_size=1, max_size=50))
@settings(max_examples=50, deadline=None)
def test_never_ahead_of_the_clock_it_follows(waits_s: list[float]) -> None:
    pacer = make()
    now_s, ticks = 100.0, 0
    for wait_s in waits_s:
        now_s += wait_s
        ticks += pacer.ticks_due(now_s)
        assert ticks <= (now_s - 100.0) / pacer.interval_s + 1.001
