import math

import numpy as np
import pytest

from goalreach_msgs_py.arena import Arena
from goalreach_sim.camera_view import emission, emission_axes, emission_exponent


def test_leds_of_the_goal_wall_shine_along_y() -> None:
    arena = Arena()
    axes = emission_axes(arena.landmark_array_m, arena.width_m, arena.length_m)
    assert axes.tolist() == [[0.0, 1.0, 0.0]] * 3


def test_leds_of_the_other_walls_shine_inwards() -> None:
    leds = np.array([[0.1, 3.0, 1.0], [3.9, 3.0, 1.0], [2.0, 5.9, 1.0]])
    axes = emission_axes(leds, 4.0, 6.0)
    assert axes.tolist() == [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]


def test_half_as_strong_at_the_half_angle() -> None:
    half_rad = math.radians(60)
    exponent = emission_exponent(half_rad)
    assert emission(1.0, exponent) == 1.0
    assert emission(math.cos(half_rad), exponent) == pytest.approx(0.5, abs=1e-12)
    assert emission(-1.0, exponent) == 0.0
    # At a right angle: cos(45 deg)^4.819 with 4.819 = ln 2 / -ln cos 30 deg.
    assert emission(0.0, exponent) == pytest.approx(0.1882, abs=1e-4)
