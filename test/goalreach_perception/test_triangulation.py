from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_perception.one_image_pose import align, level_points, triangulate

PLACES = np.array([[1.0 + 1.0j, 1.0 + 0.0j, 1.0 - 1.0j]])


def test_a_robot_at_the_origin_that_faces_plus_x() -> None:
    rays = np.array([[np.exp(0.25j * np.pi), 1.0, np.exp(-0.25j * np.pi)]])
    assert triangulate(PLACES, rays)[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_on_the_danger_circle_the_pose_is_finite() -> None:
    # (1, 1), (2, 0), (1, -1) and the origin lie on the circle around (1, 0) of radius 1.
    places = np.array([[1.0 + 1.0j, 2.0 + 0.0j, 1.0 - 1.0j]])
    assert np.isfinite(triangulate(places, places / np.abs(places))).all()


def test_two_leds_in_one_direction_do_not_matter() -> None:
    places = np.array([[1.0 + 1.0j, 2.0 + 2.0j, 1.0 - 1.0j]])
    pose = triangulate(places, places / np.abs(places))[0]
    assert pose == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


@given(st.floats(0.2, 3.4), st.floats(0.8, 5.0), st.floats(-3.1, 3.1), st.permutations([0, 1, 2]))
@settings(max_examples=100, deadline=None)
def test_both_guesses_are_exact_without_noise(
    x_m: float, y_m: float, azimuth: float, order: list[int]
) -> None:
    places = np.array([[0.889, 1.778 + 0.508j, 2.667]])[:, order]
    seen = (places - (x_m + 1j * y_m)) * np.exp(-1j * azimuth)
    expected = [x_m, y_m, azimuth]  # its y is beyond the danger circle
    assert triangulate(places, seen / np.abs(seen))[0] == pytest.approx(expected, abs=1e-6)
    assert align(places, seen)[0] == pytest.approx(expected, abs=1e-9)
    assert align(places[:, :2], seen[:, :2])[0] == pytest.approx(expected, abs=1e-9)


def test_a_ray_is_extended_to_the_height_of_its_led() -> None:
    # Up one quarter and right one half per unit forward; an LED 0.5 m up is 2 m ahead, 1 m right.
    slopes = np.array([0.5, -0.25])
    assert level_points(slopes, np.array(0.5), np.array(0.0)) == pytest.approx(2.0 - 1.0j)


def test_the_axis_of_a_camera_tilted_by_45_degrees_rises_as_it_goes() -> None:
    found = level_points(np.array([0.0, 0.0]), np.array(0.5), np.array(math.pi / 4))
    assert found == pytest.approx(0.5 + 0.0j)


def test_a_falling_ray_never_reaches_an_led_above() -> None:
    assert np.isnan(level_points(np.array([0.0, 0.1]), np.array(0.5), np.array(0.0)))
