from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

import numpy as np
import pytest

from goalreach_lab.localization.bound_study import one_image_bound
from goalreach_msgs_py.arena import ArenaConfig
from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_model import HEIGHT, LEDS, TILT_BIAS, Lens
from goalreach_perception.one_image_pose import (
    ImageGeometry,
    Solutions,
    _pose_jacobian,
    solve_poses,
)

CAMERA = PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3)
LED_PLACES = ArenaConfig().landmark_array_m
HEIGHT_M = 1.1
TILT_RAD = 0.12


def geometry(spots: int, nuisance: FloatArray | None = None) -> ImageGeometry:
    return ImageGeometry(
        leds_m=LED_PLACES,
        led_count=len(LED_PLACES),
        camera_height_m=HEIGHT_M,
        turns_rad=np.zeros(spots),
        tilts_rad=np.full(spots, TILT_RAD),
        lens=Lens.of_camera(CAMERA),
        nuisance_covariance=np.zeros((LEDS + 14, LEDS + 14)) if nuisance is None else nuisance,
        tilt_noise_rad=0.0,
    )


def true_pixels(x_m: float, y_m: float, azimuth: float) -> FloatArray:
    offsets_m = LED_PLACES - (x_m, y_m, HEIGHT_M)
    return CAMERA.project(offsets_m @ optical_rotation(azimuth, TILT_RAD).T)


def solve_noisy(sigma_px: float, count: int, pose: tuple[float, float, float]) -> Solutions:
    rng = np.random.default_rng(3)
    clean = true_pixels(*pose)
    pixels = (clean + sigma_px * rng.standard_normal((count, 3, 2))).reshape(-1, 2)
    return solve_poses(
        geometry(3 * count),
        pixels,
        np.full(3 * count, sigma_px),
        spots=np.arange(3 * count).reshape(-1, 3),
        leds=np.tile(np.arange(3), (count, 1)),
        seeds=np.tile(np.array(pose) + np.array([0.2, -0.2, 0.05]), (count, 1)),
    )


def test_noiseless_pixels_give_the_exact_pose() -> None:
    pose = (1.2, 3.0, -1.4)
    found = solve_poses(
        geometry(3),
        true_pixels(*pose),
        np.full(3, 0.1),
        spots=np.array([[0, 1, 2]]),
        leds=np.array([[0, 1, 2]]),
        seeds=np.array([[1.5, 2.6, -1.3]]),
    )
    assert found.poses[0] == pytest.approx(pose, abs=1e-6)
    assert found.chi2[0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize('sigma_px', [0.1, 0.3, 1.0])
@pytest.mark.parametrize(('x_m', 'y_m'), [(1.778, 2.54), (0.6, 3.5), (3.0, 4.6)])
def test_errors_reach_the_bound_and_chi_square_is_three(
    sigma_px: float, x_m: float, y_m: float
) -> None:
    azimuth = math.atan2(0.25 - y_m, 1.778 - x_m)
    found = solve_noisy(sigma_px, 4000, (x_m, y_m, azimuth))
    error = found.poses - [x_m, y_m, azimuth]
    rms_m = math.sqrt((error[:, :2] ** 2).sum(axis=1).mean())
    claimed = np.linalg.inv(found.information[0])
    assert rms_m == pytest.approx(math.sqrt(claimed[0, 0] + claimed[1, 1]), rel=0.06)
    assert found.chi2.mean() == pytest.approx(3.0, abs=0.1)
    # The bound is computed at a slightly different tilt, which hardly matters.
    bound = one_image_bound(
        x_m,
        y_m,
        leds_m=LED_PLACES,
        camera=CAMERA,
        camera_height_m=HEIGHT_M,
        pixel_sigma_px=sigma_px,
    )
    assert rms_m == pytest.approx(bound.position_sigma_m, rel=0.05)


def test_uncertain_constants_reduce_the_weights_of_the_pixels() -> None:
    nuisance = np.zeros((LEDS + 14, LEDS + 14))
    nuisance[TILT_BIAS, TILT_BIAS] = 0.003**2
    nuisance[HEIGHT, HEIGHT] = 0.006**2
    pose = (1.2, 3.0, -1.4)
    arguments: dict[str, Any] = {
        'spots': np.array([[0, 1, 2]]),
        'leds': np.array([[0, 1, 2]]),
        'seeds': np.array([pose]),
    }
    sure = solve_poses(geometry(3), true_pixels(*pose), np.full(3, 0.3), **arguments)
    unsure = solve_poses(geometry(3, nuisance), true_pixels(*pose), np.full(3, 0.3), **arguments)
    loss = sure.information[0] - unsure.information[0]
    assert np.linalg.eigvalsh(loss).min() > -1e-6 * np.abs(sure.information).max()
    assert np.trace(unsure.information[0]) < np.trace(sure.information[0])


def test_an_led_behind_the_camera_has_no_likelihood() -> None:
    found = solve_poses(
        geometry(3),
        true_pixels(1.2, 3.0, -1.4),
        np.full(3, 0.1),
        spots=np.array([[0, 1, 2]]),
        leds=np.array([[0, 1, 2]]),
        seeds=np.array([[1.2, 3.0, 1.6]]),
        iterations=0,
    )
    assert found.chi2[0] == math.inf


def test_derivatives_of_a_camera_off_the_axis() -> None:
    """A turn of the head moves the lens, too."""
    off_axis = replace(geometry(3), mount_m=(0.15, 0.05))
    leds = spots = np.array([[0, 1, 2]])
    pose = np.array([[1.2, 3.0, -1.4]])
    offsets_m, projection = off_axis.project(pose, leds, spots)
    found = _pose_jacobian(projection, offsets_m)[0]
    for state, step in enumerate((1e-5, 1e-5, 1e-6)):
        ends = [
            off_axis.project(pose + sign * step * np.eye(3)[state], leds, spots)[1].pixels_px
            for sign in (1.0, -1.0)
        ]
        measured = (ends[0] - ends[1]).reshape(-1) / (2.0 * step)
        assert found[:, state] == pytest.approx(measured, rel=1e-4, abs=1e-2)
