from __future__ import annotations

import numpy as np
import pytest

from goalreach_msgs_py.values import FloatArray, Pose2
from goalreach_perception.pose_monitor import Mode, PoseMonitor, PoseMonitorConfig

GOOD = np.diag([0.049**2, 0.049**2, 1.0])
USELESS = np.array([[0.0024, 0.0005, 0.0], [0.0005, 0.0024, 0.0], [0.0, 0.0, 1.0]])  # 54 mm


def tracking() -> PoseMonitor:
    monitor = PoseMonitor(PoseMonitorConfig())
    monitor.start(None)
    return monitor


def test_it_begins_searching() -> None:
    monitor = PoseMonitor(PoseMonitorConfig())
    assert (monitor.mode, monitor.reason) == (Mode.SEARCHING, 'no fix yet')


def test_one_led_missing_of_two_or_three_does_not_matter() -> None:
    monitor = tracking()
    for used, expected in [(3, 3), (2, 3), (1, 2), (1, 1), (0, 0), (3, 3), (0, 0)] * 20:
        monitor.update(used, expected)
        assert monitor.mode is Mode.TRACKING


@pytest.mark.parametrize(('used', 'expected'), [(1, 3), (0, 1)])
def test_a_contradicting_image_makes_the_pose_doubtful_and_the_next_led_ends_it(
    used: int, expected: int
) -> None:
    monitor = tracking()
    monitor.update(used, expected)
    assert (monitor.mode, monitor.reason) == (Mode.DOUBTFUL, 'expected LEDs are not seen')
    monitor.update(1, 1)
    assert (monitor.mode, monitor.reason) == (Mode.TRACKING, '')


@pytest.mark.parametrize(('used', 'expected'), [(2, 2), (2, 3), (3, 3)])
def test_two_leds_missing_at_once_make_it_doubtful_and_two_matched_end_it(
    used: int, expected: int
) -> None:
    monitor = tracking()
    monitor.update(0, 2)
    assert monitor.mode is Mode.DOUBTFUL
    monitor.update(used, expected)
    assert (monitor.mode, monitor.reason) == (Mode.TRACKING, '')


def test_one_match_does_not_end_doubt_and_after_five_the_pose_is_lost() -> None:
    # The spot may be another LED that matches the prediction by chance.
    monitor = tracking()
    modes = []
    for used in (0, 1, 1, 1, 1):
        monitor.update(used, 1 if used else 2)
        modes.append(monitor.mode)
    assert modes == [Mode.DOUBTFUL] * 4 + [Mode.SEARCHING]


def test_after_a_single_led_missing_three_times_two_must_match() -> None:
    monitor = tracking()
    modes = []
    for used in (0, 0, 0, 1, 2):
        monitor.update(used, max(1, used))
        modes.append(monitor.mode)
    assert modes == [Mode.DOUBTFUL] * 4 + [Mode.TRACKING]


@pytest.mark.parametrize(('used', 'expected'), [(0, 3), (1, 3), (0, 1)])
def test_five_contradicting_images_lose_the_pose(used: int, expected: int) -> None:
    monitor = tracking()
    modes = []
    for _ in range(5):
        monitor.update(used, expected)
        modes.append(monitor.mode is Mode.SEARCHING)
    assert modes == [False] * 4 + [True]


def test_without_any_led_a_pose_is_doubtful_after_two_seconds_and_lost_after_eight() -> None:
    monitor = tracking()
    modes = []
    for _ in range(200):
        monitor.update(0, 0)
        modes.append(monitor.mode)
    assert modes == [Mode.TRACKING] * 50 + [Mode.DOUBTFUL] * 149 + [Mode.SEARCHING]


def test_three_leds_must_be_matched_once_more() -> None:
    monitor = PoseMonitor(PoseMonitorConfig())
    monitor.start((0, 1, 2))
    modes = []
    for used in (2, 2, 3):
        monitor.update(used, 3)
        modes.append(monitor.mode)
    assert modes == [Mode.CONFIRMING, Mode.CONFIRMING, Mode.TRACKING]


def test_two_of_three_leds_do_not_confirm_a_pose() -> None:
    monitor = PoseMonitor(PoseMonitorConfig())
    monitor.start((0, 1, 2))
    for _ in range(7):
        monitor.update(2, 3)
        assert monitor.mode is Mode.CONFIRMING
    monitor.update(2, 3)
    assert (monitor.mode, monitor.reason) == (Mode.SEARCHING, 'a new pose was not confirmed')


@pytest.mark.parametrize(('used', 'expected'), [(0, 2), (0, 0), (1, 3)])
def test_a_pose_that_an_image_contradicts_is_not_confirmed(used: int, expected: int) -> None:
    monitor = PoseMonitor(PoseMonitorConfig())
    monitor.start((0, 1, 2))
    monitor.update(used, expected)
    assert monitor.mode is Mode.SEARCHING


def test_checks_are_due_every_second_and_at_once_after_a_contradiction() -> None:
    monitor = tracking()
    assert [monitor.check_due() for _ in range(50)].count(True) == 2
    assert not monitor.add_check(100.0)
    assert monitor.check_due()
    assert monitor.add_check(100.0)


def test_one_agreement_clears_a_contradiction() -> None:
    monitor = tracking()
    assert not monitor.add_check(100.0)
    assert not monitor.add_check(1.0)
    assert not monitor.add_check(100.0)


def test_only_a_new_pose_has_unconfirmed_leds() -> None:
    monitor = PoseMonitor(PoseMonitorConfig())
    monitor.start((0, 2, 4))
    assert monitor.unconfirmed_leds == (0, 2, 4)
    monitor.update(3, 3)
    assert not monitor.unconfirmed_leds


def test_it_may_reacquire_from_the_second_contradicting_image_on() -> None:
    monitor = PoseMonitor(PoseMonitorConfig())
    assert monitor.may_reacquire
    monitor.start(None)
    may_reacquire = []
    for used, expected in ((3, 3), (0, 3), (3, 3), (0, 3), (0, 3), (0, 3)):
        monitor.update(used, expected)
        may_reacquire.append(monitor.may_reacquire)
    assert may_reacquire == [False, False, False, False, True, True]


def test_a_useless_pose_is_forgotten_each_time_after_twice_as_long_up_to_a_limit() -> None:
    monitor = PoseMonitor(PoseMonitorConfig(check_every_frames=2))
    here = Pose2(x_m=1.0, y_m=2.0, heading_rad=0.0)
    turning = Pose2(x_m=1.01, y_m=2.01, heading_rad=2.0)
    moved = Pose2(x_m=1.03, y_m=2.0, heading_rad=0.0)

    def forgotten(*poses: Pose2, doubt: FloatArray | None = USELESS) -> list[bool]:
        return [[monitor.is_useless(pose, doubt) for _ in range(2)][1] for pose in poses]

    assert forgotten(here, moved, here, moved) == 4 * [False]
    assert forgotten(here) + forgotten(here, doubt=GOOD) + forgotten(here) == 3 * [False]
    assert forgotten(here, doubt=None) == [False]
    assert forgotten(here, turning, here) == [False, False, True]
    assert forgotten(*6 * [here]) == [*5 * [False], True]
    for _ in range(2):
        assert forgotten(*12 * [here]) == [*11 * [False], True]


@pytest.mark.parametrize('again', [False, True])
def test_a_pose_after_a_useless_one_is_confirmed_until_a_misfit_would_show(*, again: bool) -> None:
    monitor = PoseMonitor(PoseMonitorConfig(triple_confirmations=2))
    monitor.start([0, 1, 2], again=again)
    images = 0
    while monitor.mode is Mode.CONFIRMING:
        monitor.update(3, 3)
        images += 1
    assert (monitor.mode, images) == (Mode.TRACKING, 6 if again else 2)
