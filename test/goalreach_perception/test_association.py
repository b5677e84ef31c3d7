from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_msgs_py.arena import ArenaConfig
from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.association import AssociationConfig, Fix, identify, labellings
from goalreach_perception.measurement_model import HEIGHT, LEDS, MOUNT, TILT_BIAS, Lens
from goalreach_perception.one_image_pose import ImageGeometry

CAMERA = PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3)
LED_PLACES = ArenaConfig().landmark_array_m
SIZE_M = (3.556, 5.08)
TILT_RAD = 0.14


def knowledge(corners: int = 0) -> FloatArray:
    """Tilt known to 0.15 deg, height to a quarter inch, LEDs to a tenth of an inch."""
    sigmas = np.zeros(LEDS + 14 + 3 * corners)
    sigmas[TILT_BIAS], sigmas[HEIGHT], sigmas[LEDS:MOUNT] = 0.0026, 0.00635, 0.00254
    return np.diag(sigmas**2)


def solve(
    pixels: FloatArray,
    leds_m: FloatArray = LED_PLACES,
    corners_m: FloatArray | None = None,
    **options: float,
) -> Fix | None:
    corners_m = np.empty((0, 3)) if corners_m is None else corners_m
    geometry = ImageGeometry(
        leds_m=np.concatenate([leds_m, corners_m]),
        led_count=len(leds_m),
        camera_height_m=1.1,
        turns_rad=np.zeros(len(pixels)),
        tilts_rad=np.full(len(pixels), TILT_RAD),
        lens=Lens.of_camera(CAMERA),
        nuisance_covariance=knowledge(len(corners_m)),
        tilt_noise_rad=0.001,
    )
    sigmas = np.full(len(pixels), 0.05)
    config = AssociationConfig()
    return identify(geometry, pixels, sigmas, arena_size_m=SIZE_M, config=config, **options)


def view(x_m: float, y_m: float, azimuth: float, leds_m: FloatArray = LED_PLACES) -> FloatArray:
    offsets_m = leds_m - (x_m, y_m, 1.1)
    return CAMERA.project(offsets_m @ optical_rotation(azimuth, TILT_RAD).T)


def test_the_number_of_labellings() -> None:
    assert labellings(3, 3, 3)[0].shape == (6, 3)
    assert labellings(5, 3, 3)[0].shape == (60, 3)
    assert labellings(2, 3, 2)[0].shape == (6, 2)
    assert labellings(1, 3, 2)[0].shape == (0, 2)


@given(
    st.floats(0.3, 3.2),
    st.floats(2.0, 4.8),
    st.permutations([0, 1, 2]),
)
@settings(max_examples=60, deadline=None)
def test_three_leds_in_any_order(x_m: float, y_m: float, order: list[int]) -> None:
    azimuth = math.atan2(0.2 - y_m, 1.778 - x_m)
    fix = solve(view(x_m, y_m, azimuth)[order])
    assert fix is not None
    assert fix.leds[np.argsort(fix.spots)].tolist() == order
    assert (fix.x_m, fix.y_m) == pytest.approx((x_m, y_m), abs=1e-5)
    assert math.remainder(fix.azimuth_rad - azimuth, math.tau) == pytest.approx(0.0, abs=1e-6)


def test_a_spurious_spot_is_left_unassigned() -> None:
    pixels = np.concatenate([[[100.0, 80.0]], view(1.3, 3.5, -1.5)])
    fix = solve(pixels)
    assert fix is not None
    assert (fix.spots.tolist(), fix.leds.tolist()) == ([1, 2, 3], [0, 1, 2])


def test_two_leds_determine_the_pose_if_no_search_sees_the_third() -> None:
    x_m, y_m, z_m = LED_PLACES[0]
    rise_rad = math.atan2(z_m - 1.1, math.hypot(x_m - 1.5, y_m - 1.6))
    pair = view(1.5, 1.6, -1.3)[[1, 2]]
    assert solve(pair) is None
    assert solve(pair, reach_rad=rise_rad + 0.001) is None
    fix = solve(pair, reach_rad=rise_rad - 0.001)
    assert fix is not None
    assert fix.leds.tolist() == [1, 2]
    assert (fix.x_m, fix.y_m) == pytest.approx((1.5, 1.6), abs=1e-5)


def test_one_spot_or_none_gives_no_fix() -> None:
    assert solve(view(1.5, 1.6, -1.3)[:1]) is None
    assert solve(np.empty((0, 2))) is None


def test_spots_that_fit_no_pose_give_no_fix() -> None:
    assert solve(np.array([[100.0, 100.0], [110.0, 400.0], [500.0, 50.0]])) is None


def test_a_pose_within_a_tenth_of_a_metre_of_the_walls_is_refused() -> None:
    for x_m, y_m, inside in (
        (0.11, 3.5, 1),
        (0.09, 3.5, 0),
        (3.45, 3.5, 1),
        (3.47, 3.5, 0),
        (1.6, 4.97, 1),
        (1.6, 4.99, 0),
    ):
        azimuth = math.atan2(0.2 - y_m, 1.778 - x_m)
        assert (solve(view(x_m, y_m, azimuth)) is not None) == bool(inside)


def test_an_arrangement_with_the_same_image_from_two_poses_is_ambiguous() -> None:
    # An equilateral triangle of equal LEDs around the middle of the arena: each third of a turn
    # looks the same.
    turns = np.array([0.0, 2.0, 4.0]) * math.pi / 3.0
    leds = np.stack([1.8 + 0.3 * np.cos(turns), 2.5 + 0.3 * np.sin(turns), np.full(3, 1.5)], 1)
    assert solve(view(1.8, 4.0, -math.pi / 2, leds), leds) is None


def test_a_spot_is_no_corner_of_a_tag() -> None:
    """Corners are found in squares; tags that are not detected explain no spot."""
    corners_m = np.array(
        [[x + dx, 0.0, 1.3 + dz] for x in (1.0, 2.4) for dx in (0.0, 0.2) for dz in (0.0, 0.2)]
    )
    fix = solve(view(1.3, 3.5, -1.5), corners_m=corners_m)
    assert fix is not None
    assert fix.leds[np.argsort(fix.spots)].tolist() == [0, 1, 2]
    assert (fix.x_m, fix.y_m) == pytest.approx((1.3, 3.5), abs=1e-5)
