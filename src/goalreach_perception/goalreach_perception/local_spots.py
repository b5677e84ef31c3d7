"""Spots measured against their own surround: any background, width, and motion blur.

The background of a spot is a plane through a ring around it: its level the median of the ring, its
slopes those of the ring without outliers. The spread of the ring tells how uneven the background
is. The ring grows until the spot fits inside: small rings suit textured walls, large ones LEDs
that are discs. The centre is weighted by the square of the light, which suppresses what is left of
the background: on rendered walls it halves the error.
"""

from __future__ import annotations

from collections.abc import Sequence
import functools
import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Corner = tuple[int, int]
"""A pixel (u, v)."""
Image = NDArray[np.uint8]
Window = tuple[Image, int, int]
"""A part of an image, and the column and row of its top-left pixel."""

_RADII_PX = (6, 13, 30, 30)
"""Half-widths of the patches. Chosen: the last holds an LED of 20 mm radius 0.5 m away; twice, so
that a streak found at its end is measured from its middle."""
_RING_PX = 2
_FITS_SIGMAS = 3.5
"""A spot fits a patch that is this many standard deviations wide to each side. Chosen."""
_CUT_NOISE, _CUT_SPREAD = 4.0, 2.5
_LEAST_NOISE, _LEAST_SPREAD = 6.0, 5.0
"""Threshold above the background, and least contrast, in standard deviations of the read noise and
of the surround. Chosen: on textured walls hardly a speckle reaches the contrast."""
_EVEN = 1.5
"""The surround of this spread, in standard deviations of the read noise, is even. Chosen."""
_POINT_SHARE = 1.15
"""Least ratio of the light of a spot to that of its brightest pixel. Chosen: a hot pixel has 1, a
point through a lens of 0.3 px in the middle of a pixel 1.2."""
_ROUND = 1.8
"""Largest ratio of the variances along and across a spot that does not move. Chosen: two merged
LEDs have more."""
_ROUND_PX2 = 0.25
_NARROW_PX2 = 0.8
NARROW_SIGMA_PX = 0.1
"""A spot of less variance is sampled too coarsely: its centre has this error (measured)."""
_USUAL_SIGMA_PX = 1.2
"""Width at which an uneven background displaces a spot by spread / contrast (measured)."""
ALONE, TRACKED = 2.0, 8.0
"""Factors on that error in a single image, and while tracking: there it repeats from image to
image, and a filter would average it. Chosen: with 8 it is as consistent as in the dark."""
_STREAK_ERROR = 0.06
"""Error of the centre of a streak along it, in lengths of the streak: uneven motion. Chosen."""
_COARSE_PX = 25
"""Square wider than a spot on an uneven background. Chosen."""
_MOST_PEAKS = 200
"""Most peaks that are compared with one another. Chosen: a flat disc has many of one height."""
_SAMPLES, _QUANTILES = 32, [5, 16, 27]
"""Pixels of a ring for a quick look, and the ranks of the quantiles 0.16, 0.5 and 0.84."""
LIKELY = 0.8
"""Part of the least contrast that passes that look, apart from whole frames of lit walls. Chosen:
with it no LED is lost."""
_TINY = 1e-3
_WORD = 8


class LocalSpot(NamedTuple):
    """A spot measured against its surround.

    Attributes:
        u_px: Centre, column.
        v_px: Centre, row.
        sigma_px: Standard deviation of the centre, per axis.
        peak_dn: Largest grey value near its middle.
        background_dn: Grey value of the surround.
        even: Whether the surround is even.
        bright: Whether the peak stands out from the surround.
        led_like: Whether contrast, width and shape may be those of an LED.
    """

    u_px: float
    v_px: float
    sigma_px: float
    peak_dn: float
    background_dn: float
    even: bool
    bright: bool
    led_like: bool


class LocalSpotMeter:
    """Measures spots on uneven backgrounds and of unknown width.

    Args:
        centroid_sigma_px: Error of a bright spot per axis.
        noise_dn: Read noise of a pixel (1 sigma).
        repeated: Factor on the error by an uneven background.
    """

    def __init__(self, *, centroid_sigma_px: float, noise_dn: float, repeated: float) -> None:
        self._repeated = repeated
        self._sampling_px = centroid_sigma_px
        self._noise_dn = noise_dn
        self._grids = [_Grid(radius) for radius in _RADII_PX]

    def measure(self, image: Image, corners: list[Corner], streak_px: float) -> list[LocalSpot]:
        """Measure the spots at or near pixels, drawn out by motion to at most `streak_px`."""
        found: list[LocalSpot] = []
        rows, corners = list(range(len(corners))), [*corners]
        for grid in self._grids:
            if dim := [row for row in rows if found and not found[row].bright]:
                likely = self.outstanding(image, [corners[row] for row in dim])
                rows = [row for row in rows if found[row].bright or dim.index(row) in likely]
            if not rows:
                break
            measured = self._at_radius(image, [corners[row] for row in rows], grid, streak_px)
            found = found or measured
            for row, spot in zip(rows, measured, strict=True):
                found[row] = spot
            rows = [row for row in rows if not found[row].led_like]
            for row in rows:
                u, v = round(found[row].u_px), round(found[row].v_px)
                if max(abs(u - corners[row][0]), abs(v - corners[row][1])) < grid.radius:
                    corners[row] = u, v
        return found

    def outstanding(
        self, image: Image, corners: list[Corner], part: float = LIKELY
    ) -> dict[int, Corner]:
        """Return which pixels stand out from a ring around them, each with the brightest near it.

        By a few pixels of each ring: hardly a speckle of a wall does, and its patches would cost
        many times as much.
        """
        if not corners:
            return {}
        width, pixels = image.shape[1], image.reshape(-1)
        near, rings = _sampled_offsets(width)
        first = np.array([[v * width + u] for u, v in corners])
        middles = pixels.take(first + near, mode='clip')
        values = pixels.take(first + rings, mode='clip').reshape(len(first), -1, _SAMPLES)
        values.sort(axis=2)
        low, middle, high = values[:, :, _QUANTILES].transpose(2, 0, 1).astype(np.float32)
        least_dn = np.maximum(_LEAST_NOISE * self._noise_dn, 0.5 * _LEAST_SPREAD * (high - low))
        good = (middles.max(axis=1)[:, None] - middle >= part * least_dn).any(axis=1)
        brightest = (first[:, 0] + near[middles.argmax(axis=1)]).tolist()
        rows: list[int] = np.flatnonzero(good).tolist()
        return {row: divmod(brightest[row], width)[::-1] for row in rows}

    def _at_radius(
        self, image: Image, corners: list[Corner], grid: _Grid, streak_px: float
    ) -> list[LocalSpot]:
        """Measure spots in patches of one size; LED-like are those that fit into them."""
        patches = cut_patches(image, corners, grid.radius)
        ring = patches.take(grid.ring, axis=1)
        ordered = ring.copy()
        ordered.sort(axis=1)
        quantiles = ordered.take(grid.quantiles, axis=1).tolist()
        surrounds = [self._surround(*of_ring) for of_ring in quantiles]
        limits = np.array([around[3:] for around in surrounds], np.float32)
        np.maximum(ring, limits[:, :1], out=ring)
        np.minimum(ring, limits[:, 1:2], out=ring)
        planes = ring.dot(grid.slopes)
        planes[:, 0] = limits[:, 2]
        patches -= planes.dot(grid.plane)
        centres = patches.take(grid.centre, axis=1).tolist()
        np.maximum(patches, 0.0, out=patches)
        shapes = [_Shape.of_moments(row, streak_px) for row in patches.dot(grid.moments).tolist()]
        np.multiply(patches, patches, out=patches)
        weighted = patches.dot(grid.centroid).tolist()
        levels = zip(map(max, centres), surrounds, strict=True)
        spots, (height, width) = [], image.shape
        for (u, v), (squared, sum_u, sum_v), shape, (above_cut_dn, around) in zip(
            corners, weighted, shapes, levels, strict=True
        ):
            light2 = max(squared, _TINY)
            du, dv = sum_u / light2, sum_v / light2
            at_u, at_v = u + du, v + dv
            reach = max(_FITS_SIGMAS * shape.sigma_px + 0.5 * shape.streak_px + 1.0, 3.0)
            fits = reach + max(abs(du), abs(dv)) <= grid.radius + 1.0
            fits = fits and reach <= at_u <= width - 1 - reach
            fits = fits and reach <= at_v <= height - 1 - reach
            spots.append(self._judge((at_u, at_v), shape, above_cut_dn, around[:3], fits=fits))
        return spots

    def _surround(self, low_dn: float, middle_dn: float, high_dn: float) -> tuple[float, ...]:
        """Return what follows from the quantiles 0.16, 0.5 and 0.84 of a ring, grey values.

        Returns:
            Threshold above the background, spread, background; the limits beyond which pixels of
            the ring are outliers; background and threshold together.
        """
        spread_dn = 0.5 * (high_dn - low_dn)
        cut_dn = max(_CUT_SPREAD * spread_dn, _CUT_NOISE * self._noise_dn)
        out_dn = 2.0 * spread_dn + 1.0
        limits_dn = middle_dn - out_dn, middle_dn + out_dn, middle_dn + cut_dn
        return cut_dn, spread_dn, middle_dn, *limits_dn

    def _judge(
        self,
        centre_px: tuple[float, float],
        shape: _Shape,
        above_cut_dn: float,
        surround_dn: tuple[float, ...],
        *,
        fits: bool,
    ) -> LocalSpot:
        """Return a spot by its centre, its shape, its peak above a threshold, and its surround."""
        cut_dn, spread_dn, background_dn = surround_dn
        contrast_dn = above_cut_dn + cut_dn
        bright = contrast_dn >= max(_LEAST_NOISE * self._noise_dn, _LEAST_SPREAD * spread_dn)
        point = shape.light < _POINT_SHARE * above_cut_dn
        sampling_px = NARROW_SIGMA_PX if shape.across_px2 < _NARROW_PX2 else self._sampling_px
        uneven_dn = self._repeated * spread_dn * max(shape.sigma_px / _USUAL_SIGMA_PX, 1.0)
        noise_px = max(self._noise_dn, uneven_dn) / max(contrast_dn, 1.0)
        sigma_px = math.hypot(sampling_px, noise_px, _STREAK_ERROR * shape.streak_px)
        even, led_like = spread_dn <= _EVEN * self._noise_dn, fits and shape.round and not point
        peak_dn, led_like = background_dn + contrast_dn, bright and led_like
        return LocalSpot(*centre_px, sigma_px, peak_dn, background_dn, even, bright, led_like)


class _Shape(NamedTuple):
    """Second moments of a spot.

    Attributes:
        light: Sum of its grey values.
        sigma_px: Standard deviation along its longest axis, apart from the streak.
        across_px2: Variance along its shortest axis.
        streak_px: Length by which motion has drawn it out.
        round: Whether it is round apart from that.
    """

    light: float
    sigma_px: float
    across_px2: float
    streak_px: float
    round: bool

    @classmethod
    def of_moments(cls, moments: list[float], streak_px: float) -> _Shape:
        """Return the shape by the moments 1, u, v, u u, u v, v v of the light.

        A streak of length L, here at most `streak_px`, adds the variance L^2 / 12 along it. What
        is round without one has none.
        """
        total, u, v, uu, uv, vv = moments
        light = max(total, _TINY)
        u, v = u / light, v / light
        uu, uv, vv = uu / light - u * u, uv / light - u * v, vv / light - v * v
        middle, half = 0.5 * (uu + vv), math.hypot(0.5 * (uu - vv), uv)
        along, across = max(middle + half, 0.0), max(middle - half, 0.0)
        streak = max(along - _ROUND * across - _ROUND_PX2, 0.0)
        is_round, sigma_px = 12.0 * streak <= streak_px * streak_px, math.sqrt(along - streak)
        return cls(total, sigma_px, across, math.sqrt(12.0 * streak), is_round)


class _Grid:
    """Pixels of a square patch: its ring, its centre, its slopes and its moments."""

    def __init__(self, radius: int) -> None:
        axis = np.arange(-radius, radius + 1, dtype=np.float32)
        v, u = (plane.reshape(-1) for plane in np.meshgrid(axis, axis, indexing='ij'))
        away = np.maximum(np.abs(u), np.abs(v))
        self.radius = radius
        self.ring = np.flatnonzero(away > radius - _RING_PX)
        self.centre = np.flatnonzero(away <= 1.0)
        count = len(self.ring)
        self.quantiles = [int(0.16 * count), count // 2, int(0.84 * count)]
        self.plane = np.stack([np.ones_like(u), u, v])
        self.slopes = (self.plane[:, self.ring] / np.square(u[self.ring]).sum()).T.copy()
        self.moments = np.stack([*self.plane, u * u, u * v, v * v], axis=1)
        self.centroid = np.ascontiguousarray(self.moments[:, :3])


@functools.lru_cache(maxsize=4)
def _sampled_offsets(width: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return 16 pixels around a peak, and 32 of each ring, in an image of a width."""
    near, sides = np.arange(-1, 3), []
    for radius in _RADII_PX[:-1]:
        out = radius - _RING_PX // 2
        side = np.linspace(-out, out, _SAMPLES // 4, endpoint=False).astype(np.intp)
        sides += [side - width * out, out + width * side, width * out - side, -out - width * side]
    return (width * near[:, None] + near).reshape(-1), np.concatenate(sides)


def cut_patches(image: Image, corners: list[Corner], radius: int) -> NDArray[np.float32]:
    """Return the flat patches around pixels, zero outside the image and for a negative u."""
    size, (height, width) = 2 * radius + 1, image.shape
    patches = np.zeros((len(corners), size, size), dtype=np.float32)
    for index, (u, v) in enumerate(corners):
        left, top = u - radius, v - radius
        if left >= 0 and top >= 0 and left + size <= width and top + size <= height:
            patches[index] = image[top : top + size, left : left + size]
        elif u >= 0:
            part = image[max(top, 0) : top + size, max(left, 0) : left + size]
            row, column = max(-top, 0), max(-left, 0)
            patches[index, row : row + part.shape[0], column : column + part.shape[1]] = part
    return patches.reshape(len(corners), size * size)


def cut_window(image: Image, centre_px: Sequence[float], half_px: int) -> Window:
    """Return the window around a pixel; empty outside the image."""
    u, v = int(centre_px[0]), int(centre_px[1])
    left, top = max(0, u - half_px), max(0, v - half_px)
    return image[top : max(0, v + half_px + 1), left : max(0, u + half_px + 1)], left, top


def brightest_pixel(pixels: Image, left: int, top: int) -> Corner:
    """Return the pixel of the image where a window is brightest; negative if that is empty."""
    if pixels.size == 0:
        return -1, -1
    u, v = cv2.minMaxLoc(pixels)[3]
    return left + u, top + v


def stand_out(image: cv2.typing.MatLike, square_px: int = _COARSE_PX) -> Image:
    """Return how much each pixel is above what is wider than a spot.

    An opening by a square keeps the edges of lit walls (the top-hat transform, Meyer 1979).
    """
    square = np.ones((square_px, square_px), np.uint8)
    return np.asarray(cv2.morphologyEx(image, cv2.MORPH_TOPHAT, square), np.uint8)


def peaks_that_stand_out(image: Image, count: int, least_dn: float) -> list[Corner]:
    """Return the pixels of the highest peaks that stand out, highest first.

    In an image of half the size, in which a peak is at least `least_dn` high: a quarter of the
    pixels cost a fifth, and their mean is smooth.
    """
    half = cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    above = stand_out(half, side := _COARSE_PX // 2 + 1)
    highest = cv2.dilate(above, np.ones((side, side), np.uint8))
    peaks = np.flatnonzero(above >= np.maximum(highest, np.uint8(max(least_dn, 1.0))))
    order = np.argsort(-above.reshape(-1)[peaks].astype(np.int16), kind='stable')[:_MOST_PEAKS]
    found: list[Corner] = []
    for place in peaks[order].tolist():
        v, u = divmod(place, above.shape[1])
        if all(max(abs(u - a), abs(v - b)) > side // 2 for a, b in found):
            found.append((u, v))
            if len(found) == count:
                break
    return [(2 * u, 2 * v) for u, v in found]


def brighter_than(image: Image, level_dn: float, most: int) -> NDArray[np.intp]:
    """Return the (n, 2) pixels (u, v) above a level, row by row; zeros where n is above `most`.

    Eight pixels are tested at a time, since nearly all are dark.
    """
    _, mask = cv2.threshold(image, level_dn, 1, cv2.THRESH_BINARY)
    pixels: NDArray[np.intp]
    if (count := cv2.countNonZero(mask)) > most or not count:
        return np.zeros((count, 2), np.intp)
    flat = np.asarray(mask).reshape(-1)
    if flat.size % _WORD:
        pixels = np.flatnonzero(flat)
    else:
        words = np.flatnonzero(flat.view(np.uint64))
        pixels = (_WORD * words[:, None] + np.arange(_WORD)).reshape(-1)
        pixels = pixels[flat[pixels] > 0]
    v, u = np.divmod(pixels, image.shape[1])
    return np.stack([u, v], axis=1)


def moment_sums(radius: int, near: int) -> NDArray[np.float32]:
    """Return the matrix that maps a flat patch to its moments and the light on its border.

    The columns 1, u, v, u^2 + v^2 and border of the inner part of the patch; then, for a larger
    patch, those of all of it.
    """
    axis = np.arange(-radius, radius + 1, dtype=np.float64)
    v, u = (plane.reshape(-1) for plane in np.meshgrid(axis, axis, indexing='ij'))
    away = np.maximum(np.abs(u), np.abs(v))
    whole = np.stack([np.ones_like(u), u, v, u * u + v * v])
    columns = [[*whole * (away <= size), away == size] for size in sorted({near, radius})]
    return np.concatenate(columns, dtype=np.float32).T.copy()
