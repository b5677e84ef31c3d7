import math

import pytest

from goalreach_sim.contact import Walls, first_crossing


def make_walls() -> Walls:
    return Walls(width_m=4.0, length_m=6.0, body_radius_m=0.5)


def test_clearance_is_to_the_nearest_wall() -> None:
    walls = make_walls()
    assert walls.clearance_m(2.0, 3.0) == 1.5
    assert walls.clearance_m(0.75, 3.0) == 0.25
    assert walls.clearance_m(2.0, 5.75) == -0.25


@pytest.mark.parametrize(
    ('x_m', 'y_m', 'direction_rad'),
    [
        (3.5, 3.0, 0.0),
        (2.0, 5.5, math.pi / 2),
        (0.5, 3.0, math.pi),
        (2.0, 0.5, -math.pi / 2),
    ],
)
def test_each_wall_is_sensed_and_blocks(x_m: float, y_m: float, direction_rad: float) -> None:
    walls = make_walls()
    assert walls.touch_directions_rad(x_m, y_m) == (direction_rad,)

    def blocks(angle_rad: float) -> bool:
        return walls.blocks(x_m, y_m, math.cos(angle_rad), math.sin(angle_rad))

    assert blocks(direction_rad)
    assert blocks(direction_rad + 1.5)
    assert not blocks(direction_rad + math.pi / 2)
    assert not blocks(direction_rad - math.pi / 2)
    assert not blocks(direction_rad + math.pi)


def test_a_corner_is_two_contacts() -> None:
    assert make_walls().touch_directions_rad(0.5, 0.5) == (math.pi, -math.pi / 2)
    assert make_walls().touch_directions_rad(2.0, 2.0) == ()


def test_clamp_moves_no_point_of_the_free_floor() -> None:
    assert make_walls().clamp(1.0, 2.0) == (1.0, 2.0)
    assert make_walls().clamp(0.1, 9.0) == (0.5, 5.5)


def test_first_crossing_stays_outside_the_wall() -> None:
    crossing_s = first_crossing(lambda t: 0.3 - t, 1.0)
    assert crossing_s == pytest.approx(0.3, abs=1e-15)
    assert 0.3 - crossing_s >= 0.0
