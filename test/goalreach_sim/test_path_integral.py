import math

from hypothesis import example, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_sim.path_integral import Motion, displacement, quarter_turn_time


def test_straight_with_acceleration() -> None:
    # 2 m/s and 1 m/s^2 for 2 s: 6 m towards +y.
    x_m, y_m = displacement(Motion(math.pi / 2, 0.0, 0.0, 2.0, 1.0), 2.0)
    assert x_m == pytest.approx(0.0, abs=1e-15)
    assert y_m == pytest.approx(6.0, abs=1e-14)


@pytest.mark.parametrize('turn_rad', [0.3, math.pi / 2, math.pi, 20.0])
def test_constant_turn_is_an_arc(turn_rad: float) -> None:
    # Radius 1 m: from heading 0, x = sin(angle), y = 1 - cos(angle).
    x_m, y_m = displacement(Motion(0.0, turn_rad, 0.0, turn_rad, 0.0), 1.0)
    assert x_m == pytest.approx(math.sin(turn_rad), abs=1e-11)
    assert y_m == pytest.approx(1.0 - math.cos(turn_rad), abs=1e-11)


def test_speeding_up_while_turning_matches_a_fine_sum() -> None:
    motion = Motion(0.4, 0.9, -2.0, -0.3, 0.7)
    t = (np.arange(200_000) + 0.5) / 200_000 * 1.7
    heading = 0.4 + 0.9 * t - 1.0 * t * t
    speed = -0.3 + 0.7 * t
    x_m, y_m = displacement(motion, 1.7)
    assert x_m == pytest.approx(float((speed * np.cos(heading)).mean() * 1.7), abs=1e-9)
    assert y_m == pytest.approx(float((speed * np.sin(heading)).mean() * 1.7), abs=1e-9)


def test_quarter_turn_by_hand() -> None:
    # From 80 deg at 10 deg/s: 90 deg after 1 s.
    motion = Motion(math.radians(80), math.radians(10), 0.0, 1.0, 0.0)
    assert quarter_turn_time(motion, 5.0) == pytest.approx(1.0, abs=1e-12)
    assert quarter_turn_time(motion, 0.5) == 0.5


def test_quarter_turn_that_comes_back() -> None:
    # From 0 at 1 rad/s, slowing by 2 rad/s^2: t - t^2 is zero again after 1 s.
    assert quarter_turn_time(Motion(0.0, 1.0, -2.0, 1.0, 0.0), 5.0) == pytest.approx(1.0)


def test_straight_never_turns() -> None:
    assert quarter_turn_time(Motion(0.1, 0.0, 0.0, 1.0, 0.0), 7.0) == 7.0


@example(heading=0.0, turn=0.0, change=5e-324, limit_s=1.0)
@given(
    heading=st.floats(-10.0, 10.0),
    turn=st.floats(-3.0, 3.0),
    change=st.floats(-3.0, 3.0),
    limit_s=st.floats(0.001, 3.0),
)
@settings(max_examples=100, deadline=None)
def test_no_quarter_is_passed_before(
    heading: float, turn: float, change: float, limit_s: float
) -> None:
    end_s = quarter_turn_time(Motion(heading, turn, change, 1.0, 0.0), limit_s)
    assert 0.0 < end_s <= limit_s
    t = np.linspace(1e-8, end_s - 1e-8, 50)
    quarters = (heading + turn * t + 0.5 * change * t * t) / (math.pi / 2)
    inside = quarters[np.abs(quarters - np.round(quarters)) > 1e-7]
    assert len(set(np.floor(inside).tolist())) <= 1
