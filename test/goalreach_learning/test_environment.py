import math

from hypothesis import assume, given
from hypothesis import strategies as st
import pytest

from goalreach_learning.kinematic_drive import OptionEnvironment
from goalreach_msgs_py.arena import BODY_RADIUS_M, LENGTH_M, WIDTH_M, Arena
from goalreach_msgs_py.regions import RegionMap

ENVIRONMENT = OptionEnvironment(Arena())
X1, X2 = 1.1811, 2.3749
Y1, Y2 = 1.6891, 3.3909

free_x = st.floats(BODY_RADIUS_M, WIDTH_M - BODY_RADIUS_M)
free_y = st.floats(BODY_RADIUS_M, LENGTH_M - BODY_RADIUS_M)
actions = st.integers(0, 7)


def test_drives_to_the_next_border() -> None:
    end = ENVIRONMENT.advance(0.5, 1.0, (0, 0), 0)
    assert (end.x_m, end.y_m) == pytest.approx((X1, 1.0))
    assert (end.region, end.bumped) == ((1, 0), False)
    assert end.length_m == pytest.approx(X1 - 0.5)


def test_drives_to_wall_contact() -> None:
    end = ENVIRONMENT.advance(0.5, 1.0, (0, 0), 6)
    assert (end.x_m, end.y_m) == pytest.approx((0.5, 0.225))
    assert (end.region, end.bumped) == ((0, 0), True)


def test_diagonal_takes_the_nearer_of_border_and_wall() -> None:
    # down right from (0.9, 0.4): wall after 0.175, border only after 0.2811 along each axis
    end = ENVIRONMENT.advance(0.9, 0.4, (0, 0), 7)
    assert end.bumped
    assert (end.x_m, end.y_m) == pytest.approx((1.075, 0.225))
    # from (0.9, 0.6) the border comes first
    end = ENVIRONMENT.advance(0.9, 0.6, (0, 0), 7)
    assert not end.bumped
    assert (end.x_m, end.y_m) == pytest.approx((X1, 0.6 - 0.2811))


def test_a_corner_of_regions_is_crossed_at_once() -> None:
    knots = (0.0, 1.0, 1.0, 2.0, 2.0, 3.0)  # borders at 1 and 2, exact in binary
    arena = Arena(
        width_m=3.0,
        length_m=3.0,
        regions=RegionMap(x_knots_m=knots, y_knots_m=knots),
        landmarks_m=((0.5, 0.0, 1.0), (1.5, 0.0, 1.0), (2.5, 0.0, 1.0)),
        starts=(),
    )
    end = OptionEnvironment(arena).advance(0.5, 0.5, (0, 0), 1)
    assert end.region == (1, 1)
    assert end.length_m == pytest.approx(math.sqrt(0.5))


def test_on_a_border_the_region_entered_counts() -> None:
    end = ENVIRONMENT.advance(2.0, 3.0, (1, 1), 4)  # leftwards to the border x = X1
    assert end.region == (0, 1)
    back = ENVIRONMENT.advance(end.x_m, end.y_m, end.region, 0)
    assert back.region == (1, 1)
    assert back.length_m == pytest.approx(0.0, abs=1e-12)


def test_along_a_border_the_region_stays() -> None:
    end = ENVIRONMENT.advance(X1, 3.0, (0, 1), 6)
    assert end.region == (0, 0)
    end = ENVIRONMENT.advance(X1, 3.0, (1, 1), 6)
    assert end.region == (1, 0)


def test_overshoot_drives_past_the_border() -> None:
    environment = OptionEnvironment(Arena(), overshoot_m=0.1)
    end = environment.advance(0.5, 2.5, (0, 1), 0)
    assert end.x_m == pytest.approx(X1 + 0.1)
    assert end.region == (1, 1)


def test_overshoot_into_a_wall_is_a_bump() -> None:
    environment = OptionEnvironment(Arena(), overshoot_m=1.0)
    # 0.9561 from the border to contact
    end = environment.advance(1.5, 2.5, (1, 1), 4)
    assert end.bumped
    assert end.x_m == pytest.approx(0.225)


@given(free_x, free_y, actions)
def test_stays_on_the_free_floor_and_goes_straight(x: float, y: float, action: int) -> None:
    region = ENVIRONMENT.regions.region_at(x, y)
    end = ENVIRONMENT.advance(x, y, region, action)
    assert BODY_RADIUS_M - 1e-9 <= end.x_m <= WIDTH_M - BODY_RADIUS_M + 1e-9
    assert BODY_RADIUS_M - 1e-9 <= end.y_m <= LENGTH_M - BODY_RADIUS_M + 1e-9
    assert math.hypot(end.x_m - x, end.y_m - y) == pytest.approx(end.length_m, abs=1e-9)
    assert (end.region == region) == end.bumped


@given(free_x, free_y, actions)
def test_agrees_with_small_steps(x: float, y: float, action: int) -> None:
    regions, arena = ENVIRONMENT.regions, Arena()
    region = regions.region_at(x, y)
    end = ENVIRONMENT.advance(x, y, region, action)
    dx, dy = (end.x_m - x), (end.y_m - y)
    assume(end.length_m > 1e-6)
    for k in range(1, 20):  # nothing happens before the end
        px, py = x + dx * k / 20, y + dy * k / 20
        assert regions.region_at(px, py) == region
        assert arena.is_free(px, py)
