"""Joining inputs at the times of a leading one."""

from __future__ import annotations

from collections import Counter
import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_msgs_py.alignment import (
    InputAligner,
    Interpolation,
    either_pressed,
    interpolate_head,
    interpolate_odometry,
    moved_on,
)
from goalreach_msgs_py.inputs import InputMonitor
from goalreach_msgs_py.values import HeadAngles, Odometry, Pose2, Twist2

MS = 1_000_000
REST = Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0)


def linear(one: float, other: float, fraction: float) -> float:
    return one + fraction * (other - one)


def aligner(*, delay_s: float = 0.0, **kinds: Interpolation | None) -> InputAligner:
    return InputAligner('image', kinds or {'a': linear}, wait_s=0.1, delay_s=delay_s)


@given(st.permutations(['image', 'a', 'b'] * 4))
def test_equal_stamps_are_joined_as_they_came_whatever_the_order(order: list[str]) -> None:
    join, sent = aligner(a=linear, b=linear), Counter[str]()
    joined: list[tuple[int, dict[str, float]]] = []
    for name in order:
        stamp = 10 * MS * sent[name]
        sent[name] += 1
        joined += join.add(name, stamp, math.sin(stamp + ord(name[0])), 0.0)
    assert [stamp for stamp, _ in joined] == [0, 10 * MS, 20 * MS, 30 * MS]
    for stamp, inputs in joined:
        assert inputs == {name: math.sin(stamp + ord(name[0])) for name in inputs}


def test_a_value_waits_for_a_later_sample_and_takes_what_lies_between() -> None:
    join = aligner()
    assert not join.add('a', 10 * MS, 1.0, 0.0)
    assert not join.add('image', 15 * MS, 'I', 0.01)
    assert join.needs_clock
    assert join.add('a', 30 * MS, 5.0, 0.02) == [(15 * MS, {'image': 'I', 'a': 2.0})]
    assert not join.needs_clock


def test_a_sample_of_the_same_stamp_is_taken_as_it_is() -> None:
    join = aligner()
    for stamp, value in ((10, 0.1), (20, 0.7), (30, 0.2)):
        join.add('a', stamp * MS, value, 0.0)
    assert join.add('image', 20 * MS, 'I', 0.0) == [(20 * MS, {'image': 'I', 'a': 0.7})]


def test_an_input_that_came_with_the_last_image_is_waited_for_longer() -> None:
    join = aligner()
    join.add('a', 40 * MS, 1.0, 0.0)
    assert len(join.add('image', 40 * MS, 'I', 0.0)) == 1
    assert not join.add('image', 80 * MS, 'J', 0.0)
    assert not join.needs_clock
    assert not join.complete(4.9)
    assert join.add('a', 80 * MS, 2.0, 4.9) == [(80 * MS, {'image': 'J', 'a': 2.0})]


def test_a_stamp_that_happens_to_be_equal_makes_no_longer_wait() -> None:
    join = aligner()
    for stamp in (20, 40):
        join.add('a', stamp * MS, float(stamp), 0.0)
    assert len(join.add('image', 40 * MS, 'I', 0.0)) == 1
    join.add('a', 60 * MS, 60.0, 0.0)
    assert not join.add('image', 65 * MS, 'J', 0.0)
    assert [stamp for stamp, _ in join.complete(0.11)] == [65 * MS]


def test_two_stamps_that_happen_to_be_equal_block_nothing_for_ever() -> None:
    join = aligner()
    for stamp in (40, 80):
        join.add('a', stamp * MS, float(stamp), 0.0)
        assert len(join.add('image', stamp * MS, 'I', 0.0)) == 1
    assert not join.add('image', 115 * MS, 'J', 0.0)
    assert [stamp for stamp, _ in join.complete(5.1)] == [115 * MS]


def test_other_inputs_are_waited_for_at_most_the_stated_time_then_extrapolated() -> None:
    join = aligner()
    join.add('a', 10 * MS, 1.0, 0.0)
    join.add('a', 20 * MS, 2.0, 0.0)
    assert not join.add('image', 35 * MS, 'I', 1.0)
    assert not join.complete(1.09)
    ((stamp, inputs),) = join.complete(1.11)
    assert (stamp, inputs['a']) == (35 * MS, pytest.approx(3.5))


def test_samples_further_away_than_the_stated_time_are_not_used() -> None:
    join = aligner()
    join.add('a', 0, 1.0, 0.0)
    join.add('image', 0, 'I', 0.0)
    for tick in range(1, 8):
        assert not [s for s in join.add('image', 40 * MS * tick, 'I', 0.0) if s[0] > 100 * MS]
    assert join.missing == {'a': 2}


def test_an_input_that_holds_is_not_waited_for_unless_it_comes_with_every_image() -> None:
    join = aligner(camera=None)
    assert not join.add('image', 40 * MS, 'I', 0.0)
    assert join.add('camera', 7 * MS, 'K', 9.0) == [(40 * MS, {'image': 'I', 'camera': 'K'})]
    assert join.add('image', 80 * MS, 'J', 9.0) == [(80 * MS, {'image': 'J', 'camera': 'K'})]
    for stamp in (120 * MS, 160 * MS):
        join.add('camera', stamp, 'L', 9.0)
        assert join.add('image', stamp, 'J', 9.0) == [(stamp, {'image': 'J', 'camera': 'L'})]
    assert not join.add('image', 200 * MS, 'J', 9.0)
    assert len(join.add('camera', 200 * MS, 'M', 9.0)) == 1


def test_a_microsecond_beside_the_image_is_no_reason_to_wait() -> None:
    join, complete = aligner(camera=None), []
    for tick in range(1, 5):
        complete += join.add('image', 40 * MS * tick, 'I', 0.0)
        complete += join.add('camera', 40 * MS * tick + 1000, 'K', 0.0)
    assert [stamp // MS for stamp, _ in complete] == [40, 80, 120, 160]


def test_values_at_other_times_follow_a_complete_set() -> None:
    join = aligner(delay_s=0.06)
    for tick in range(11):
        join.add('a', 10 * MS * tick, float(tick), 0.0)
    assert join.add('image', 95 * MS, 'I', 0.0) == [(95 * MS, {'image': 'I', 'a': 9.5})]
    assert not join.is_exact
    assert join.follower_at('a', 35 * MS) == 3.5
    assert join.add('image', 100 * MS, 'J', 0.0) == [(100 * MS, {'image': 'J', 'a': 10.0})]
    assert join.is_exact


def test_images_whose_stamps_are_early_wait_for_later_samples() -> None:
    join = aligner(delay_s=-0.02)
    join.add('a', 100 * MS, 1.0, 0.0)
    assert not join.add('image', 100 * MS, 'I', 0.0)
    assert join.add('a', 120 * MS, 2.0, 0.0) == [(100 * MS, {'image': 'I', 'a': 1.0})]


def test_the_last_stamp_is_completed_again_and_an_older_one_is_not() -> None:
    join = aligner()
    join.add('a', 40 * MS, 1.0, 0.0)
    for _ in range(2):
        assert join.add('image', 40 * MS, 'I', 0.0) == [(40 * MS, {'image': 'I', 'a': 1.0})]
    assert not join.add('image', 39 * MS, 'I', 0.0)


def test_values_that_wait_do_not_pile_up() -> None:
    join = InputAligner('image', {'a': linear}, wait_s=math.inf, depth=3)
    for tick in range(10):
        join.add('image', tick, tick, 0.0)
    join.add('a', 0, 1.0, 0.0)
    assert [stamp for stamp, _ in join.add('a', 20, 2.0, 0.0)] == [7, 8, 9]


def test_a_sample_from_the_future_does_not_stay() -> None:
    join = aligner()
    join.add('a', 10**15, 99.0, 0.0)
    join.add('a', 10 * MS, 1.0, 0.0)
    join.add('a', 30 * MS, 3.0, 0.0)
    assert join.add('image', 20 * MS, 'I', 0.0) == [(20 * MS, {'image': 'I', 'a': 2.0})]


def test_what_is_missing_is_reported_by_name() -> None:
    join, monitor = aligner(), InputMonitor()
    for tick in range(12):
        join.add('image', 40 * MS * tick, 'I', 0.0)
        monitor.received('a', 0, tick * 0.04)
        if tick == 0:
            join.add('a', 0, 1.0, 0.0)
    assert [t.text for t in monitor.check(0.48, join.missing)] == ['6 messages were missing']


def test_odometry_turns_the_shorter_way() -> None:
    one, other = (
        Odometry(pose=Pose2(x_m=x, y_m=2.0 * x, heading_rad=heading), twist=REST)
        for x, heading in ((1.0, 3.0), (2.0, -3.0))
    )
    pose = interpolate_odometry(one, other, 0.25).pose
    assert (pose.x_m, pose.y_m) == (1.25, 2.5)
    assert pose.heading_rad == pytest.approx(3.0 + 0.25 * (math.tau - 6.0))


def test_a_turret_turns_the_shorter_way() -> None:
    one = HeadAngles(turret_rad=3.0, pan_rad=0.1, tilt_rad=-0.2)
    other = HeadAngles(turret_rad=-3.0, pan_rad=0.3, tilt_rad=0.2)
    head = interpolate_head(one, other, 0.5)
    assert abs(head.turret_rad) == pytest.approx(math.pi)
    assert [head.pan_rad, head.tilt_rad] == pytest.approx([0.2, 0.0])


def test_a_bumper_of_either_sample_is_pressed() -> None:
    assert either_pressed((True, False, False), (False, False, True), 0.5) == (True, False, True)


def test_a_pose_moves_on_by_odometry_of_another_frame() -> None:
    # A metre ahead and a quarter turn, from heading 90 degrees in the map.
    before = Pose2(x_m=5.0, y_m=5.0, heading_rad=math.pi)
    after = Pose2(x_m=4.0, y_m=5.0, heading_rad=-math.pi / 2)
    pose = moved_on(Pose2(x_m=1.0, y_m=2.0, heading_rad=math.pi / 2), before, after)
    assert [pose.x_m, pose.y_m] == pytest.approx([1.0, 3.0])
    assert abs(pose.heading_rad) == pytest.approx(math.pi)
