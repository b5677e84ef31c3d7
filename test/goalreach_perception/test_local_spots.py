"""Pixels, patches and spots of small images, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from goalreach_perception.local_spots import (
    LocalSpotMeter,
    _sampled_offsets,
    _Shape,
    brighter_than,
    cut_patches,
    moment_sums,
)
from led_arena import spot_image


@pytest.mark.parametrize('shape', [(5, 7), (6, 8)])  # eight pixels are looked at together
def test_the_pixels_above_a_level(shape: tuple[int, int]) -> None:
    image = np.random.default_rng(0).integers(0, 20, shape).astype(np.uint8)
    expected = np.argwhere(image > 12)[:, ::-1]
    assert np.array_equal(brighter_than(image, 12.0, len(expected)), expected)
    assert not brighter_than(image, 12.0, len(expected) - 1).any()


def test_patches_are_zero_beyond_the_border() -> None:
    image = np.arange(1, 43, dtype=np.uint8).reshape(6, 7)
    corners = [(0, 0), (6, 5), (3, 2), (2, 2), (4, 3), (0, 3), (5, 2), (3, 4)]
    patches = cut_patches(image, [*corners, (-1, -1)], 2).reshape(-1, 5, 5)
    around = np.pad(image, 2)
    assert patches[:-1].tolist() == [around[v : v + 5, u : u + 5].tolist() for u, v in corners]
    assert not patches[-1].any()


def test_the_moments_of_a_patch() -> None:
    patch = np.zeros((7, 7))
    patch[2, 4], patch[3, 2], patch[0, 3] = 2.0, 3.0, 5.0  # at (1, -1), (-1, 0), (0, -3)
    inner, whole = [5.0, -1.0, -2.0, 7.0, 5.0], [10.0, -1.0, -17.0, 52.0, 5.0]
    assert (patch.reshape(-1) @ moment_sums(3, 1)).tolist() == inner + whole


def test_a_quick_look_takes_eight_pixels_of_each_side_of_three_squares() -> None:
    near, rings = _sampled_offsets(1000)
    assert sorted(near.tolist()) == [1000 * v + u for v in range(-1, 3) for u in range(-1, 3)]
    v, u = np.divmod(rings + 500, 1000) - np.array([[0], [500]])
    for out, sides in zip(
        (5, 12, 29), np.stack([u, v]).reshape(2, 3, -1).swapaxes(0, 1), strict=True
    ):
        assert [np.count_nonzero(at == end) for at in sides for end in (out, -out)] == [9] * 4
        assert len({*map(tuple, sides.T.tolist())}) == 32


def test_a_shape_is_told_by_its_moments() -> None:
    # Of 10 grey values around (1, -2), variances of 4 and 1 px^2 along the diagonals.
    moments, streak = [10.0, 10.0, -20.0, 35.0, -5.0, 65.0], 4.0 - 1.8 * 1.0 - 0.25
    for streak_px, is_round in ((4.83, False), (4.84, True)):
        expected = (10.0, math.sqrt(4.0 - streak), 1.0, math.sqrt(12.0 * streak), is_round)
        assert _Shape.of_moments(moments, streak_px) == pytest.approx(expected)


@pytest.mark.parametrize(
    ('sigma_px', 'error_px', 'off'),
    [(1.1, math.hypot(0.1, 8.0 / 120.0), 0.02), (2.4, 16.0 / 120.0, 0.2)],  # sampling; wider
)
def test_a_spot_on_an_uneven_wall_errs_by_its_spread(
    sigma_px: float, error_px: float, off: float
) -> None:
    meter = LocalSpotMeter(centroid_sigma_px=0.025, noise_dn=1.5, repeated=2.0)
    image = spot_image([(60.0, 50.0, 120.0)], sigma_px=sigma_px)
    (dark,) = meter.measure(image, [(60, 50)], 0.0)
    assert (dark.background_dn, dark.peak_dn, dark.even) == (10.0, 130.0, True)
    assert dark.sigma_px == pytest.approx(math.hypot(0.025, 1.5 / 120.0), rel=0.01)
    image[::2] += 8  # 4 to each side of the middle
    (lit,) = meter.measure(image, [(60, 50)], 0.0)
    assert lit.sigma_px == pytest.approx(error_px, rel=off)
    assert not lit.even
