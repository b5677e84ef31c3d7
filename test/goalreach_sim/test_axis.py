from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from goalreach_sim.axis import Axis


def make_axis() -> Axis:
    return Axis(max_speed=2.0, acceleration=4.0)


def test_ramps_up_and_cruises() -> None:
    axis = make_axis()
    axis.go(2.0)
    axis.advance(0.25)
    assert (axis.velocity, axis.position) == (1.0, 0.125)
    axis.advance(1.25)  # 0.25 s of ramp and 1 s at 2
    assert axis.velocity == 2.0
    assert axis.position == pytest.approx(0.5 + 2.0, abs=1e-15)


def test_clips_the_velocity_command() -> None:
    axis = make_axis()
    axis.go(-9.0)
    axis.advance(10.0)
    assert axis.velocity == -2.0


def test_reverses_through_rest() -> None:
    axis = make_axis()
    axis.go(2.0)
    axis.advance(0.5)
    axis.go(-2.0)
    axis.advance(0.5)
    assert axis.velocity == 0.0
    assert axis.position == pytest.approx(1.0, abs=1e-15)
    axis.advance(0.5)
    assert axis.velocity == -2.0
    assert axis.position == pytest.approx(0.5, abs=1e-15)


def test_long_move_is_a_trapezoid() -> None:
    axis = make_axis()
    axis.move_by(3.0)  # 0.5 s up (0.5), 1 s at 2, 0.5 s down (0.5)
    axis.advance(0.5)
    assert (axis.velocity, axis.position) == (2.0, 0.5)
    axis.advance(1.0)
    assert axis.position == pytest.approx(2.5, abs=1e-15)
    axis.advance(0.5)
    assert (axis.velocity, axis.position) == (0.0, 3.0)
    assert not axis.is_moving


def test_short_move_is_a_triangle() -> None:
    axis = make_axis()
    axis.move_by(-0.25)  # 4 t^2 / 2 = 0.125 at t = 0.25 s, there at 0.5 s
    axis.advance(0.25)
    assert axis.velocity == pytest.approx(-1.0, abs=1e-15)
    assert axis.position == pytest.approx(-0.125, abs=1e-15)
    axis.advance(0.25)
    assert (axis.velocity, axis.position) == (0.0, -0.25)


def test_move_begun_too_fast_overshoots_and_comes_back() -> None:
    axis = make_axis()
    axis.go(2.0)
    axis.advance(0.5)  # at 0.5 with 2: needs 0.5 to stop
    axis.move_by(0.1)
    axis.advance(0.5)
    assert axis.velocity == pytest.approx(0.0, abs=1e-12)
    assert axis.position == pytest.approx(1.0, abs=1e-12)
    axis.advance(5.0)
    assert axis.position == 0.6


def test_move_slower_than_now_first_slows_down() -> None:
    axis = make_axis()
    axis.go(2.0)
    axis.advance(0.5)
    axis.speed = 1.0
    axis.move_by(2.0)
    axis.advance(0.25)
    assert axis.velocity == 1.0
    axis.advance(10.0)
    assert axis.position == 2.5


def test_stalled_axis_starts_again_from_rest() -> None:
    axis = make_axis()
    axis.move_by(3.0)
    axis.advance(1.0)
    axis.stall()
    assert axis.velocity == 0.0
    assert axis.is_moving
    axis.advance(0.1)
    assert axis.velocity == pytest.approx(0.4, abs=1e-12)
    axis.advance(10.0)
    assert axis.position == 3.0


COMMANDS = st.lists(
    st.tuples(st.sampled_from(['go', 'move']), st.floats(-3.0, 3.0), st.floats(0.01, 2.0)),
    min_size=1,
    max_size=8,
)


def follow(axis: Axis, commands: list[tuple[str, float, float]], steps: int) -> None:
    for kind, value, duration_s in commands:
        if kind == 'go':
            axis.go(value)
        else:
            axis.move_by(value)
        for _ in range(steps):
            axis.advance(duration_s / steps)


@given(commands=COMMANDS)
@settings(max_examples=60, deadline=None)
def test_state_does_not_depend_on_the_step(commands: list[tuple[str, float, float]]) -> None:
    coarse, fine = make_axis(), make_axis()
    follow(coarse, commands, 1)
    follow(fine, commands, 50)
    assert fine.position == pytest.approx(coarse.position, abs=1e-9)
    assert fine.velocity == pytest.approx(coarse.velocity, abs=1e-9)


@given(commands=COMMANDS)
@settings(max_examples=60, deadline=None)
def test_limits_hold(commands: list[tuple[str, float, float]]) -> None:
    axis = make_axis()
    step_s = 0.01
    for kind, value, _ in commands:
        if kind == 'go':
            axis.go(value)
        else:
            axis.move_by(value)
        for _ in range(30):
            before, start = axis.velocity, axis.position
            axis.advance(step_s)
            assert abs(axis.velocity) <= 2.0 + 1e-12
            assert abs(axis.velocity - before) <= 4.0 * step_s + 1e-9
            assert abs(axis.position - start) <= 2.0 * step_s + 1e-9


@given(distance=st.floats(-5.0, 5.0), speed=st.floats(-2.0, 2.0))
@settings(max_examples=100, deadline=None)
def test_every_move_ends_at_its_goal(distance: float, speed: float) -> None:
    axis = make_axis()
    axis.go(speed)
    axis.advance(0.3)
    goal = axis.position + distance
    axis.move_by(distance)
    axis.advance(20.0)
    assert axis.position == pytest.approx(goal, abs=1e-12)
    assert not axis.is_moving
