from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_perception.detection import DetectionConfig, SpotDetector
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


def test_the_second_brightest_spot_if_the_brightest_is_skipped() -> None:
    image = spot_image([(300.0, 200.0, 200.0), (320.0, 205.0, 90.0)])
    first = DETECTOR.in_windows(image, [(310.0, 200.0)], [25])
    second = DETECTOR.in_windows(image, [(310.0, 200.0)], [25], skip_px=first.pixels_px.tolist())
    assert first.pixels_px[0] == pytest.approx([300.0, 200.0], abs=0.05)
    assert second.pixels_px[0] == pytest.approx([320.0, 205.0], abs=0.05)


def test_other_lights_than_points_are_rejected() -> None:
    hot = spot_image([])
    hot[200, 300] = 200
    wide = spot_image([(300.0, 200.0, 120.0)], sigma_px=3.0)
    double = spot_image([(300.0, 200.0, 100.0), (304.5, 200.0, 100.0)])
    cut = spot_image([(1.0, 200.0, 150.0)])
    for image in (hot, wide, double, cut):
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


def test_windows_outside_the_image_are_empty() -> None:
    image = spot_image([(5.0, 5.0, 200.0)])
    spots = DETECTOR.in_windows(image, [(-100.0, 50.0), (700.0, 50.0), (20.0, 900.0)], [20] * 3)
    assert spots.led_like == [False] * 3


def test_a_brighter_background_is_subtracted() -> None:
    spots = DETECTOR.in_frame(spot_image([(200.4, 300.6, 100.0)], background_dn=80.0))
    assert spots.pixels_px[0] == pytest.approx([200.4, 300.6], abs=0.02)
