import math

from hypothesis import given, settings
from hypothesis import strategies as st

from goalreach_sim.sensors import BUMPER_COUNT, pressed_bumpers


def pressed(directions_deg: list[float], base_yaw_deg: float) -> list[int]:
    flags = pressed_bumpers([math.radians(d) for d in directions_deg], math.radians(base_yaw_deg))
    assert len(flags) == BUMPER_COUNT == 20
    return [index for index, flag in enumerate(flags) if flag]


def test_nothing_touched() -> None:
    assert pressed([], 12.0) == []


def test_between_two_sensors_both_are_pressed() -> None:
    assert pressed([9.0], 0.0) == [0, 1]
    assert pressed([185.0], 0.0) == [10, 11]


def test_straight_at_a_sensor_the_ends_of_its_neighbours_are_pressed_too() -> None:
    assert pressed([90.0], 0.0) == [4, 5, 6]
    assert pressed([0.0], 0.0) == [0, 1, 19]


def test_a_corner_presses_two_groups() -> None:
    assert pressed([185.0, -85.0], 0.0) == [10, 11, 15, 16]


def test_the_base_carries_the_sensors() -> None:
    # The wall at -90 deg, the base turned by -85 deg: seen at -5 deg from the base.
    assert pressed([-90.0], -85.0) == [0, 19]


@given(direction_deg=st.floats(-720.0, 720.0), yaw_deg=st.floats(-720.0, 720.0))
@settings(max_examples=100, deadline=None)
def test_every_direction_is_covered_by_two_or_three_neighbours(
    direction_deg: float, yaw_deg: float
) -> None:
    indices = pressed([direction_deg], yaw_deg)
    assert len(indices) in (2, 3)
    centre = math.radians(direction_deg - yaw_deg)
    for index in indices:
        assert math.cos(index * math.radians(18.0) - centre) >= math.cos(math.radians(18.001))
