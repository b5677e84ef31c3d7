import dataclasses
import math

import numpy as np
from numpy.typing import NDArray
import pytest

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_msgs_py.values import FloatArray
from goalreach_sim.camera_renderer import (
    CameraRenderer,
    pixel_shares,
    spot_window,
    true_lens,
)
from goalreach_sim.camera_view import CameraPose, OpticsConfig

LEDS_M = np.array([[2.0, 0.0, 1.0]])
CAMERA = PinholeCamera(fx_px=500.0, fy_px=500.0, cx_px=320.0, cy_px=240.0)
NONE = noise_preset('none')


def pose(distance_m: float, azimuth_rad: float) -> CameraPose:
    return CameraPose(
        centre_m=np.array([2.0, distance_m, 1.0]),
        azimuth_rad=azimuth_rad,
        tilt_rad=0.0,
        velocity_m_per_s=np.zeros(3),
        azimuth_rad_per_s=0.0,
        tilt_rad_per_s=0.0,
    )


def render(
    distance_m: float,
    *,
    noise: NoiseModel = NONE,
    optics: OpticsConfig | None = None,
    seed: int = 1,
    azimuth_rad: float = -math.pi / 2,
    leds_m: FloatArray = LEDS_M,
) -> NDArray[np.uint8]:
    rng, event_rng = np.random.default_rng(seed).spawn(2)
    renderer = CameraRenderer(
        CAMERA,
        leds_m,
        (4.0, 6.0),
        optics=optics or OpticsConfig(led_radius_m=0.0),
        noise=noise,
        rng=rng,
        event_rng=event_rng,
    )
    return renderer.render(pose(distance_m, azimuth_rad))


def centroid(image: NDArray[np.uint8], dark_dn: int = 10) -> tuple[float, float]:
    light = image.astype(np.float64) - dark_dn
    rows, columns = np.indices(light.shape)
    return (
        float((light * columns).sum() / light.sum()),
        float((light * rows).sum() / light.sum()),
    )


def test_led_straight_ahead_is_at_the_principal_point() -> None:
    image = render(4.0)
    assert image.shape == (480, 640)
    assert image.dtype == np.uint8
    # Flux 18000 / 16 = 1125, share of the middle pixel erf(0.5 / 1.2 / sqrt 2)^2 = 0.104388.
    assert image[240, 320] == 10 + 117
    # The next pixel has erf's share from 0.5 to 1.5 px, 0.23282, along u: 84.6, rounded.
    assert image[240, 321] == 10 + 85
    assert image[0, 0] == 10
    assert centroid(image) == pytest.approx((320.0, 240.0), abs=1e-9)


def test_turning_left_moves_the_led_right() -> None:
    # tan(0.2) * 500 px = 101.355 px to the right.
    u_px, v_px = centroid(render(4.0, azimuth_rad=-math.pi / 2 + 0.2))
    assert u_px == pytest.approx(320.0 + 101.355, abs=0.02)
    assert v_px == pytest.approx(240.0, abs=0.02)


def test_flux_falls_with_the_square_of_the_range() -> None:
    near = render(2.5).astype(float) - 10.0
    far = render(5.0).astype(float) - 10.0
    # Rounding takes a little of the faint rim.
    assert near.sum() == pytest.approx(18000 / 6.25, rel=0.03)
    assert far.sum() == pytest.approx(18000 / 25.0, rel=0.03)


def test_default_peak_far_away_is_above_the_noise() -> None:
    assert 60 <= int(render(5.0).max()) - 10 <= 80


def test_close_led_saturates_and_its_spot_grows() -> None:
    image = render(0.5, optics=OpticsConfig(led_radius_m=0.01))
    assert image.max() == 255
    # sigma = hypot(1.2, 500 * 0.01 / 0.5 / 2) = 5.14 px: peak 72000 / (2 pi sigma^2) = 433,
    # so more than 245 within a radius of sqrt(2 sigma^2 ln(433 / 245)): 95 px.
    assert (image == 255).sum() == pytest.approx(95, abs=6)


def test_led_behind_the_camera_is_not_seen() -> None:
    assert (render(4.0, azimuth_rad=math.pi / 2) == 10).all()


def test_read_noise_matches_the_model() -> None:
    image = render(4.0, noise=dataclasses.replace(NONE, read_noise_dn=2.0))
    dark = image[:200].astype(float)
    assert dark.mean() == pytest.approx(10.0, abs=0.05)
    # Rounding adds 1/12 to the variance.
    assert dark.std() == pytest.approx(math.sqrt(4.0 + 1.0 / 12.0), rel=0.01)


def test_dropout_darkens_the_led() -> None:
    assert (render(4.0, noise=dataclasses.replace(NONE, dropout_probability=1.0)) == 10).all()


def test_dropout_rate_matches_the_model() -> None:
    noise = dataclasses.replace(NONE, dropout_probability=0.3)
    rng, event_rng = np.random.default_rng(4).spawn(2)
    renderer = CameraRenderer(
        CAMERA,
        LEDS_M,
        (4.0, 6.0),
        optics=OpticsConfig(),
        noise=noise,
        rng=rng,
        event_rng=event_rng,
    )
    seen = [renderer.render(pose(4.0, -math.pi / 2))[240, 320] > 50 for _ in range(500)]
    assert 1.0 - np.mean(seen) == pytest.approx(0.3, abs=0.06)


def test_spurious_light_is_rendered() -> None:
    noise = dataclasses.replace(NONE, dropout_probability=1.0, spurious_probability=1.0)
    places = []
    for seed in range(6):
        image = render(4.0, noise=noise, seed=seed)
        assert image.max() > 30
        places.append(centroid(image))
    assert np.ptp(places, axis=0).min() > 100.0


def test_same_seed_same_image() -> None:
    nominal = NoiseModel()
    assert (render(4.0, noise=nominal, seed=7) == render(4.0, noise=nominal, seed=7)).all()
    assert (render(4.0, noise=nominal, seed=7) != render(4.0, noise=nominal, seed=8)).any()


def test_true_lens_keeps_all_but_the_focal_length() -> None:
    lens = true_lens(CAMERA, 1.01)
    assert (lens.fx_px, lens.fy_px) == pytest.approx((505.0, 505.0))
    assert (lens.cx_px, lens.cy_px) == (320.0, 240.0)


def test_pixel_fractions_by_hand() -> None:
    # sigma = 1, centred on pixel 5: erf(0.5 / sqrt 2) = 0.382925, next 0.241730.
    shares = pixel_shares(5.0, 1.0, 4, 7)
    assert shares == pytest.approx([0.241730, 0.382925, 0.241730], abs=1e-6)


@pytest.mark.parametrize('centre_px', [5.0, 5.37, 4.5])
def test_pixel_fractions_keep_flux_and_centre(centre_px: float) -> None:
    shares = pixel_shares(centre_px, 1.2, -20, 31)
    assert shares.sum() == pytest.approx(1.0, abs=1e-12)
    assert (shares * np.arange(-20, 31)).sum() == pytest.approx(centre_px, abs=1e-12)


def test_window_covers_the_visible_spot() -> None:
    rows, columns = spot_window(100.2, 50.7, 1.5, 1000.0, (480, 640))
    peak_dn = 1000.0 / (2 * math.pi * 1.5**2)
    for edge, centre in (
        (rows.start - 1, 50.7),
        (rows.stop, 50.7),
        (columns.start - 1, 100.2),
        (columns.stop, 100.2),
    ):
        assert peak_dn * math.exp(-((edge - centre) ** 2) / (2 * 1.5**2)) < 0.05


@pytest.mark.parametrize(('u_px', 'v_px'), [(-50.0, 10.0), (10.0, 900.0), (1e6, 1e6)])
def test_window_outside_the_image_is_empty(u_px: float, v_px: float) -> None:
    rows, columns = spot_window(u_px, v_px, 1.2, 1000.0, (480, 640))
    assert (rows.stop - rows.start, columns.stop - columns.start) == (0, 0)


def test_window_is_cut_at_the_border() -> None:
    rows, columns = spot_window(0.0, 479.0, 1.2, 1000.0, (480, 640))
    assert rows.stop == 480
    assert columns.start == 0
    assert rows.start < 479
    assert columns.stop > 1


def test_an_led_of_a_side_wall_shines_across_the_arena() -> None:
    optics, leds_m = (
        OpticsConfig(led_radius_m=0.0, led_flux_dn=4500.0),
        np.array([[0.0, 3.0, 1.0]]),
    )
    ahead = render(3.0, optics=optics, leds_m=leds_m, azimuth_rad=math.pi)
    aside_m, turn = 2.0 * math.sqrt(3.0), -2.0 * math.pi / 3.0
    aside = render(3.0 + aside_m, optics=optics, leds_m=leds_m, azimuth_rad=turn)
    # 2 m away; then 4 m, and at its half angle: an eighth.
    assert (ahead[240, 320], aside[240, 320]) == (10 + 117, 10 + 15)
