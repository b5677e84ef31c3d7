from __future__ import annotations

import math

import numpy as np
import pytest

from goalreach_lab.localization.bound_study import Bound, one_image_bound
from goalreach_msgs_py.arena import ArenaConfig
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_perception.head_tracker import HeadConfig

CAMERA = PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3)
LED_PLACES = ArenaConfig().landmark_array_m


def bound_at(x_m: float, y_m: float, sigma_px: float = 0.3) -> Bound:
    return one_image_bound(
        x_m,
        y_m,
        leds_m=LED_PLACES,
        camera=CAMERA,
        camera_height_m=1.1,
        pixel_sigma_px=sigma_px,
    )


def test_the_distance_from_two_leds_side_by_side_by_hand() -> None:
    # LEDs 1 m right and left, 4 m ahead and 0.5 m above a level camera that looks between them.
    # By symmetry the distance y is independent of x and azimuth. With u = f X / y and
    # v = -f 0.5 / y the derivatives by y are f / 16 and f 0.5 / 16, each twice, so
    # sigma_y = 16 / (f sqrt(2 (1 + 0.25))) = 16 / (554.2563 * 1.581139) m for a noise of 1 px.
    leds = np.array([[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0]])
    bound = one_image_bound(
        0.0,
        4.0,
        leds_m=leds,
        camera=CAMERA,
        camera_height_m=0.5,
        pixel_sigma_px=1.0,
        head=HeadConfig(tilt_minimum_rad=0.0, tilt_maximum_rad=0.0),
    )
    assert bound.leds == 2
    assert math.sqrt(bound.covariance[1, 1]) == pytest.approx(0.018257, rel=1e-4)


def test_the_bound_grows_with_the_pixel_noise() -> None:
    one, ten = bound_at(1.5, 3.0, 0.1), bound_at(1.5, 3.0, 1.0)
    assert ten.position_sigma_m == pytest.approx(10.0 * one.position_sigma_m)
    assert ten.heading_sigma_rad == pytest.approx(10.0 * one.heading_sigma_rad)


def test_where_no_two_leds_fit_there_is_no_bound() -> None:
    assert bound_at(2.0, 0.41).position_sigma_m == math.inf


def test_all_three_leds_fit_at_four_places_in_five() -> None:
    xs, ys = np.linspace(0.25, 3.3, 12).tolist(), np.linspace(0.25, 4.8, 16).tolist()
    bounds = [bound_at(x_m, y_m) for y_m in ys for x_m in xs]
    three = [bound.position_sigma_m / 0.0254 for bound in bounds if bound.leds == 3]
    assert 0.7 < len(three) / len(bounds) < 0.9
    assert 0.25 < float(np.median(three)) < 0.40  # a third of an inch
