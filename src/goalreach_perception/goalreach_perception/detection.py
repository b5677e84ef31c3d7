"""Sub-pixel detection of LED spots, in windows around predictions or in the whole frame.

The centre of a spot is its intensity-weighted centroid in a small patch around its peak, with
background and noise subtracted. Rejected are hot pixels (too little light for their peak),
reflections, lamps and overlapping spots (too wide), and spots cut off by the border of the image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import FloatArray


@dataclass(frozen=True, kw_only=True)
class DetectionConfig(Configuration):
    """Thresholds of the spot detector."""

    minimum_peak_dn: float = parameter(
        20.0,
        'Least peak of a spot above the background, grey values (chosen)',
        within=(3.0, 255.0),
    )
    centroid_sigma_px: float = parameter(
        0.025,
        'Error of a bright spot per axis, px (1 sigma): sampling and saturation (measured while '
        'driving: 0.008 to 0.010; chosen larger, since it repeats from image to image: with 0.010 '
        'a filter that calibrates itself is overconfident after ten minutes)',
        within=(0.001, 5.0),
    )
    maximum_spots: int = parameter(
        5, 'Largest number of spots of a whole frame (chosen)', within=(2, 8)
    )
    window_half_px: int = parameter(
        20, 'Smallest half-width of a tracking window, px (chosen)', within=(8, 100)
    )


class Spots(NamedTuple):
    """Spots of one image.

    Attributes:
        pixels_px: (n, 2) centres (u, v); (0, 0) is the centre of the top-left pixel.
        sigmas_px: (n,) standard deviation of the centre, per axis.
        peaks_dn: Largest grey value of each.
        bright: Whether the peak is above the threshold.
        led_like: Whether light and width are those of an LED through this lens.
    """

    pixels_px: FloatArray
    sigmas_px: FloatArray
    peaks_dn: list[int]
    bright: list[bool]
    led_like: list[bool]

    def select(self, rows: list[int]) -> Spots:
        """Return some of the spots."""
        if rows == list(range(len(self.peaks_dn))):
            return self
        return Spots(
            self.pixels_px[rows],
            self.sigmas_px[rows],
            [self.peaks_dn[row] for row in rows],
            [self.bright[row] for row in rows],
            [self.led_like[row] for row in rows],
        )

    def concatenated(self, other: Spots) -> Spots:
        """Return these spots followed by others."""
        return Spots(
            np.concatenate([self.pixels_px, other.pixels_px]),
            np.concatenate([self.sigmas_px, other.sigmas_px]),
            self.peaks_dn + other.peaks_dn,
            self.bright + other.bright,
            self.led_like + other.led_like,
        )


Image = NDArray[np.uint8]

_BACKGROUND_ROWS = 4
"""Number of evenly spaced rows the background is averaged over. Chosen: a bright LED in one of
them, 640 pixels wide, raises it by a third of a grey value."""
_NOISE_LEVEL = 4.0
"""Threshold above the background, in sigmas of the noise. Chosen."""
_SATURATED_DN = 250
_HOT_PIXEL_SHARE = 0.45
"""Least ratio of the light of a spot to that of a point with the same peak. Chosen: spots have at
least 0.6 of it, single pixels at most 0.4."""
_WIDEST = 2.0
_WIDEST_SATURATED = 9.0
"""Largest variance of a spot over that of the lens. Chosen: an LED 0.35 m away, far into
saturation, has 7.5; one that is not saturated at most 1.1."""
_MAXIMUM_BRIGHT = 6000
"""An image with more bright pixels is overexposed. Chosen."""
_WORD = 8


class SpotDetector:
    """Finds LEDs in mono8 images.

    Args:
        config: The thresholds.
        spot_sigma_px: Width of the lens's point-spread function (1 sigma).
        read_noise_dn: Noise of a pixel, grey values (1 sigma).
    """

    def __init__(
        self, config: DetectionConfig, *, spot_sigma_px: float, read_noise_dn: float
    ) -> None:
        self._config = config
        self._near = math.ceil(4.0 * spot_sigma_px) + 1
        self._radius = 2 * self._near
        self._noise_dn = max(read_noise_dn, 0.5)
        self._light_per_peak = 2.0 * math.pi * spot_sigma_px**2
        self._variance_px2 = spot_sigma_px**2
        self._border = math.ceil(3.0 * spot_sigma_px)
        radii = (self._near, self._radius)
        self._sums = {radius: _moment_sums(radius, self._near) for radius in radii}

    def background_dn(self, image: Image) -> float:
        """Return the background of a frame from a few of its rows, grey values."""
        step = max(len(image) // _BACKGROUND_ROWS, 1)
        return cv2.mean(image[step // 2 :: step])[0]

    def in_windows(
        self,
        image: Image,
        centres_px: Sequence[Sequence[float]],
        halves_px: Sequence[int],
        *,
        skip_px: Sequence[Sequence[float]] = (),
    ) -> Spots:
        """Find the brightest spot of each window.

        Args:
            image: (height, width) grey values.
            centres_px: Centre (u, v) of each window.
            halves_px: Half-width of each.
            skip_px: A spot (u, v) to ignore in each window; empty to ignore none.

        Returns:
            One spot per window; `bright` and `led_like` are false where there is none.
        """
        height, width = image.shape
        corners: list[tuple[int, int]] = []
        for index, ((u, v), half) in enumerate(zip(centres_px, halves_px, strict=True)):
            left, top = max(0, int(u) - half), max(0, int(v) - half)
            window = image[top : max(0, int(v) + half + 1), left : max(0, int(u) + half + 1)]
            if window.size == 0 or left >= width or top >= height:
                corners.append((-1, -1))
                continue
            if skip_px:
                window = self._masked(window, skip_px[index][0] - left, skip_px[index][1] - top)
            _, _, _, place = cv2.minMaxLoc(window)
            corners.append((left + place[0], top + place[1]))
        return self._refine(image, corners, self.background_dn(image))

    def _masked(self, window: Image, u: float, v: float) -> Image:
        """Return a copy of a window with one spot masked."""
        window = window.copy()
        top, left = max(0, int(v) - self._radius), max(0, int(u) - self._radius)
        window[top : int(v) + self._radius + 1, left : int(u) + self._radius + 1] = 0
        return window

    def in_frame(self, image: Image) -> Spots:
        """Find the brightest LED-like spots of a whole frame, brightest first.

        Returns:
            At most `maximum_spots` LED-like spots; none if the image is overexposed.
        """
        background_dn = self.background_dn(image)
        level_dn = background_dn + max(self._config.minimum_peak_dn, 6.0 * self._noise_dn)
        places = _brighter_than(image, min(level_dn, 255.0))
        if not 0 < len(places) <= _MAXIMUM_BRIGHT:
            return self._refine(image, [], background_dn)
        values = image[places[:, 1], places[:, 0]].astype(np.int16)
        corners: list[tuple[int, int]] = []
        while len(corners) < 2 * self._config.maximum_spots:
            best = int(values.argmax())
            if values[best] < 0:
                break
            u, v = places[best]
            corners.append((int(u), int(v)))
            values[np.abs(places - places[best]).max(axis=1) <= self._radius] = -1
        spots = self._refine(image, corners, background_dn)
        rows = [row for row, good in enumerate(spots.led_like) if good]
        return spots.select(rows[: self._config.maximum_spots])

    def _refine(self, image: Image, corners: list[tuple[int, int]], background_dn: float) -> Spots:
        """Return the centroids of patches around peaks, and test their shape.

        A spot is cut off if its edge, at twice its standard deviation for a disc of light, lies
        beyond the border. Read noise displaces a centroid by noise / peak for any width of the
        spot, as measured on rendered spots (the Cramer-Rao bound of a Gaussian spot is
        sqrt(2 / pi) of that).
        """
        count = len(corners)
        height, width = image.shape
        pixels: list[tuple[float, float]] = []
        peaks = [int(image[v, u]) if u >= 0 else 0 for u, v in corners]
        moments = self._moments(image, corners, peaks, background_dn)
        good = [False] * count
        for index, ((u, v), peak, row) in enumerate(zip(corners, peaks, moments, strict=True)):
            light, sum_u, sum_v, sum_2 = row[4:] if peak >= _SATURATED_DN else row[:4]
            light = max(light, 1e-3)
            shift_u, shift_v = sum_u / light, sum_v / light
            u_px, v_px = u + shift_u, v + shift_v
            pixels.append((u_px, v_px))
            variance = 0.5 * (sum_2 / light - shift_u * shift_u - shift_v * shift_v)
            reach = max(self._border, 2.0 * math.sqrt(max(variance, 0.0)) + 1.0)
            inside = reach <= u_px <= width - 1 - reach and reach <= v_px <= height - 1 - reach
            good[index] = inside and self._is_led_like(peak, peak - background_dn, light, variance)
        sampling_px = self._config.centroid_sigma_px
        contrasts = [peak - background_dn for peak in peaks]
        sigmas = [math.hypot(sampling_px, self._noise_dn / max(c, 1.0)) for c in contrasts]
        bright = [contrast >= self._config.minimum_peak_dn for contrast in contrasts]
        return Spots(np.array(pixels).reshape(-1, 2), np.array(sigmas), peaks, bright, good)

    def _moments(
        self,
        image: Image,
        corners: list[tuple[int, int]],
        peaks_dn: list[int],
        background_dn: float,
    ) -> list[list[float]]:
        """Return the moments of the light around each peak; in a larger patch if saturated."""
        radius = self._radius if max(peaks_dn, default=0) >= _SATURATED_DN else self._near
        patches = _patches(image, corners, radius)
        patches -= background_dn + _NOISE_LEVEL * self._noise_dn
        np.maximum(patches, 0.0, out=patches)
        moments: list[list[float]] = patches.dot(self._sums[radius]).tolist()
        return moments

    def _is_led_like(
        self, peak_dn: float, contrast_dn: float, light: float, variance_px2: float
    ) -> bool:
        """Return whether peak, light and width of a spot are those of a point through the lens.

        A Gaussian reduced by the fraction q of its peak keeps 1 - q + q ln q of its light.
        """
        cut = _NOISE_LEVEL * self._noise_dn / max(contrast_dn, 1e-3)
        if contrast_dn < self._config.minimum_peak_dn or cut >= 1.0:
            return False
        expected = self._light_per_peak * contrast_dn * (1.0 - cut + cut * math.log(cut))
        widest = _WIDEST_SATURATED if peak_dn >= _SATURATED_DN else _WIDEST
        return light >= _HOT_PIXEL_SHARE * expected and variance_px2 <= widest * self._variance_px2


def _brighter_than(image: Image, level_dn: float) -> NDArray[np.intp]:
    """Return the (n, 2) pixels (u, v) above a level, row by row; only some if there are too many.

    Eight pixels are tested at a time, since nearly all are dark.
    """
    _, mask = cv2.threshold(image, level_dn, 1, cv2.THRESH_BINARY)
    pixels: NDArray[np.intp]
    flat = np.asarray(mask).reshape(-1)
    if flat.size % _WORD:
        pixels = np.flatnonzero(flat)
    else:
        words = np.flatnonzero(flat.view(np.uint64))[: _MAXIMUM_BRIGHT + 1]
        pixels = (_WORD * words[:, None] + np.arange(_WORD)).reshape(-1)
        pixels = pixels[flat[pixels] > 0]
    v, u = np.divmod(pixels, image.shape[1])
    return np.stack([u, v], axis=1)


def _patches(image: Image, corners: list[tuple[int, int]], radius: int) -> NDArray[np.float32]:
    """Return the flat patches around pixels (u, v), zero outside the image."""
    size = 2 * radius + 1
    height, width = image.shape
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


def _moment_sums(radius: int, near: int) -> NDArray[np.float32]:
    """Return the matrix that maps a flat patch to its moments 1, u, v, u^2 + v^2.

    The first four columns cover the inner part of the patch; the last four, only for a larger
    patch, cover all of it.
    """
    axis = np.arange(-radius, radius + 1, dtype=np.float64)
    v, u = np.meshgrid(axis, axis, indexing='ij')
    whole = np.stack([np.ones_like(u), u, v, u * u + v * v], axis=-1)
    inner = whole * ((np.abs(u) <= near) & (np.abs(v) <= near))[..., None]
    columns = [inner] if radius == near else [inner, whole]
    return np.concatenate(columns, axis=-1, dtype=np.float32).reshape(len(axis) ** 2, -1)
