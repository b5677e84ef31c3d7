from __future__ import annotations

import cv2
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_perception.detection import DetectionConfig, SpotDetector
from goalreach_perception.local_spots import Image
from led_arena import spot_image

DETECTOR = SpotDetector(DetectionConfig(), spot_sigma_px=1.2, read_noise_dn=1.5)


def test_a_spot_in_a_window_and_in_the_whole_frame() -> None:
    image = spot_image([(320.3, 100.7, 150.0)])
    for spots in (DETECTOR.in_windows(image, [(325.0, 96.0)], [20]), DETECTOR.in_frame(image)):
        assert spots.led_like == [True]
        assert spots.pixels_px[0] == pytest.approx([320.3, 100.7], abs=0.01)
        assert spots.peaks_dn[0] == pytest.approx(155, abs=6)


@given(st.floats(20.0, 620.0), st.floats(20.0, 460.0), st.floats(60.0, 2000.0))
@settings(max_examples=25, deadline=None)
def test_centres_have_the_stated_error_even_if_saturated(u: float, v: float, peak: float) -> None:
    spots = DETECTOR.in_frame(spot_image([(u, v, peak)]))
    assert spots.led_like == [True]
    assert np.abs(spots.pixels_px[0] - [u, v]).max() < 4.0 * spots.sigmas_px[0]


def test_the_stated_error_is_that_of_a_noisy_dim_spot() -> None:
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(60):
        place = 300.0 + rng.random(2)
        image = spot_image([(place[0], place[1], 30.0)], noise_dn=1.5, rng=rng)
        spots = DETECTOR.in_windows(image, [(300.0, 300.0)], [20])
        errors.append(spots.pixels_px[0] - place)
    rms_px = float(np.sqrt(np.mean(np.square(errors))))
    assert 0.6 * spots.sigmas_px[0] < rms_px < 1.2 * spots.sigmas_px[0]


def test_spots_are_sorted_by_brightness_up_to_a_count() -> None:
    places = [(50.0 + 70.0 * k, 200.0, 40.0 + 15.0 * k) for k in range(7)]
    spots = DETECTOR.in_frame(spot_image(places))
    assert len(spots.peaks_dn) == 5
    assert spots.peaks_dn == sorted(spots.peaks_dn, reverse=True)
    assert spots.pixels_px[0] == pytest.approx(places[6][:2], abs=0.05)


def test_a_skipped_spot_far_outside_masks_nothing() -> None:
    window = (np.full((41, 41), 9, np.uint8), 100, 100)
    window[0][20, 20] = 200
    assert DETECTOR._masked(window, (70.0, 70.0))[0].max() == 200


def test_the_second_brightest_spot_if_the_brightest_is_skipped() -> None:
    image = spot_image([(50.0, 50.0, 200.0), (70.0, 55.0, 90.0)])
    first = DETECTOR.in_windows(image, [(50.0, 50.0)], [25])
    second = DETECTOR.in_windows(image, [(50.0, 50.0)], [25], skip_px=first.pixels_px.tolist())
    assert first.pixels_px[0] == pytest.approx([50.0, 50.0], abs=0.05)
    assert second.pixels_px[0] == pytest.approx([70.0, 55.0], abs=0.05)


@pytest.mark.parametrize('sigma_px', [0.35, 0.6, 1.8, 2.5, 6.0])
def test_spots_of_any_width_are_measured(sigma_px: float) -> None:
    image = spot_image([(300.3, 200.7, 120.0), (420.0, 90.4, 60.0)], sigma_px=sigma_px)
    for spots in (DETECTOR.in_frame(image), DETECTOR.in_windows(image, [(300, 200)] * 1, [20])):
        assert spots.led_like == [True] * len(spots.peaks_dn)
        assert np.abs(spots.pixels_px[0] - [300.3, 200.7]).max() < 3.0 * spots.sigmas_px[0]
    assert len(DETECTOR.in_frame(image).peaks_dn) == 2


def _wall(rng: np.random.Generator) -> Image:
    """Return a wall of 60 grey values with blobs and speckles, half of it in the sun."""
    wall = np.full((480, 640), 60.0)
    for size in (8, 32, 128):
        wall *= cv2.resize(rng.uniform(0.85, 1.15, (size, size)), (640, 480))
    wall[:, 400:] += 60.0
    return wall.astype(np.uint8)


def test_spots_on_a_textured_wall_are_found_with_their_stated_error() -> None:
    rng = np.random.default_rng(3)
    ratios = []
    for _ in range(20):
        places = rng.uniform(-20.0, 20.0, (3, 2))
        places += np.array([[100.0, 100.0], [280.0, 300.0], [500.0, 200.0]])
        spots_px = [(u, v, 110.0) for u, v in places.tolist()]
        light = spot_image(spots_px, background_dn=0.0).astype(np.uint16) + _wall(rng)
        image = np.minimum(light, 255).astype(np.uint8)
        spots = DETECTOR.in_windows(image, (places + 4.0).tolist(), [24] * 3)
        assert spots.led_like == [True] * 3
        ratios.append((spots.pixels_px - places) / spots.sigmas_px[:, None])
        seen = DETECTOR.in_frame(image).pixels_px
        assert np.hypot(*(seen[:, None] - places).T).min(axis=1).max() < 1.0
    assert 0.2 < np.sqrt(np.mean(np.concatenate(ratios) ** 2)) < 1.3


def test_dim_spots_are_found_beside_the_edges_of_lit_walls() -> None:
    rng = np.random.default_rng(4)
    places = [(150.0, 200.0), (330.0, 220.0), (480.0, 210.0)]
    light = spot_image([(u, v, 25.0) for u, v in places], sigma_px=2.5, background_dn=0.0)
    walls = np.full((480, 640), 8.0)
    for left in (60, 250, 430):
        walls[100:400, left : left + 150] = 70.0
    noisy = light + walls + rng.normal(0.0, 1.5, walls.shape)
    spots = DETECTOR.in_frame(noisy.astype(np.uint8))
    assert np.array(sorted(spots.pixels_px.tolist())) == pytest.approx(np.array(places), abs=1.0)


def test_a_short_line_is_a_spot_only_where_the_image_moves() -> None:
    images = [spot_image([(300.0 + k, 200.0, 90.0)]) for k in np.linspace(-5.0, 5.0, 21)]
    image = np.mean(images, axis=0).astype(np.uint8)
    moving = DETECTOR.in_windows(image, [(300.0, 200.0)], [20], streak_px=11.0)
    assert moving.led_like == [True]
    assert moving.pixels_px[0] == pytest.approx([300.0, 200.0], abs=0.1)
    assert moving.sigmas_px[0] > 0.4
    still = DETECTOR.in_windows(image, [(300.0, 200.0)], [20])
    assert still.led_like == [False]


def test_a_long_line_is_one_spot_of_the_frame_wherever_along_it_the_search_begins() -> None:
    ends = np.linspace(-17.5, 17.5, 71)
    images = [spot_image([(300.0 + k, 200.0, 400.0), (450.0 + k, 260.0, 400.0)]) for k in ends]
    image = np.mean(images, axis=0).astype(np.uint8)
    spots = DETECTOR.in_frame(image, streak_px=100.0)
    places = sorted(spots.pixels_px.tolist())
    assert np.array(places) == pytest.approx(np.array([[300, 200], [450, 260]]), abs=1.0)
    assert len(DETECTOR.in_frame(image).peaks_dn) == 0


def test_other_lights_than_points_are_rejected() -> None:
    hot = spot_image([])
    hot[200, 300] = 200
    double = spot_image([(300.0, 200.0, 100.0), (304.5, 200.0, 100.0)])
    cut = spot_image([(1.0, 200.0, 150.0)])
    for image in (hot, double, cut):
        assert len(DETECTOR.in_frame(image).peaks_dn) == 0
        assert DETECTOR.in_windows(image, [(300.0, 200.0)], [20]).led_like == [False]


@pytest.mark.parametrize(('u_px', 'whole'), [(4.0, False), (5.0, False), (10.0, True)])
def test_a_wide_saturated_spot_needs_more_distance_from_the_border(
    u_px: float, *, whole: bool
) -> None:
    image = spot_image([(u_px, 200.0, 40000.0)], sigma_px=1.4)
    spots = DETECTOR.in_windows(image, [(u_px, 200.0)], [20])
    assert spots.led_like == [whole]


@pytest.mark.parametrize('level', [0, 10, 128, 255])
def test_images_without_contrast_have_no_spots(level: int) -> None:
    image = np.full((480, 640), level, dtype=np.uint8)
    assert len(DETECTOR.in_frame(image).peaks_dn) == 0
    spots = DETECTOR.in_windows(image, [(100.0, 100.0), (0.0, 479.0)], [20, 20])
    assert (spots.bright, spots.led_like) == ([False, False], [False, False])


def test_noise_alone_has_no_spots() -> None:
    rng = np.random.default_rng(0)
    mild = spot_image([], noise_dn=1.5, rng=rng)
    wild = rng.integers(0, 256, (480, 640)).astype(np.uint8)
    assert len(DETECTOR.in_frame(mild).peaks_dn) == 0
    assert len(DETECTOR.in_frame(wild).peaks_dn) == 0


@pytest.mark.parametrize('background_dn', [8.0, 60.0])
def test_windows_outside_the_image_are_empty(background_dn: float) -> None:
    image = spot_image([(5.0, 5.0, 200.0)])
    image[:, 300:] = round(background_dn)  # where that is uneven, the next image is expected so
    spot = spot_image([(5.0, 5.0, 150.0)], background_dn=background_dn)
    image[195:206, 400:411] = spot[:11, :11]
    assert DETECTOR.in_windows(image, [(404.0, 201.0)], [20]).led_like == [True]
    spots = DETECTOR.in_windows(image, [(-100.0, 50.0), (700.0, 50.0), (20.0, 900.0)], [20] * 3)
    assert spots.led_like == [False] * 3


def test_a_brighter_background_is_subtracted() -> None:
    spots = DETECTOR.in_frame(spot_image([(200.4, 300.6, 100.0)], background_dn=80.0))
    assert spots.pixels_px[0] == pytest.approx([200.4, 300.6], abs=0.02)
