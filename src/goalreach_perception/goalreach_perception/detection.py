"""LED images as sub-pixel spots: in windows around predictions, or in the whole frame.

A spot's place is its intensity-weighted centroid in a small patch around its peak, background
and noise subtracted. What is not a point of light is left out: single hot pixels (too little
light for their peak), reflections, lamps and spots that overlap (too wide), and spots cut by the
border of the image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.parameters import check_fields, parameter
from goalreach_msgs_py.values import FloatArray

__all__ = ['DetectionConfig', 'Image', 'SpotDetector', 'Spots']

Image = NDArray[np.uint8]

_BACKGROUND_STEP = 44
"""Every 44th pixel of every 44th row is enough to tell the background. Chosen."""
_HOT_PIXEL_SIGMA = 3.0
_HOT_PIXEL_SHARE = 0.4
"""A light with less than this part of the light of a lens's spot is a hot pixel. Chosen."""
_WIDE_FACTOR = 2.2
"""A spot wider than this many times the lens's is not a point of light. Chosen."""
_MAXIMUM_BRIGHT = 6000
"""More bright pixels than this are no set of LEDs: an overexposed image. Chosen."""


@dataclass(frozen=True, kw_only=True)
class DetectionConfig:
    """What counts as an LED in an image."""

    minimum_peak_dn: float = parameter(
        20.0,
        'Least peak of a spot above the background, grey values (chosen)',
        minimum=3.0,
        maximum=255.0,
    )
    centroid_sigma_px: float = parameter(
        0.04,
        'Error of a bright spot per axis, px (1 sigma): sampling of the pixels (measured on '
        'rendered spots, rounded up)',
        minimum=0.001,
        maximum=5.0,
    )
    maximum_spots: int = parameter(
        5, 'Most spots looked at in a whole frame (chosen)', minimum=2, maximum=8
    )
    window_half_px: int = parameter(
        20, 'Smallest half-width of a tracking window, px (chosen)', minimum=8, maximum=100
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)


@dataclass(frozen=True)
class Spots:
    """Points of light in one image.

    Attributes:
        pixels_px: (n, 2) centres (u, v); pixel (0, 0) is the top-left pixel's centre.
        peaks_dn: (n,) greatest grey value of each.
        good: (n,) whether it looks like an LED seen through this lens.
    """

    pixels_px: FloatArray
    peaks_dn: FloatArray
    good: NDArray[np.bool_]


class SpotDetector:
    """Finds LEDs in mono8 images.

    Args:
        config: What counts as an LED.
        spot_sigma_px: Width of the lens's point-spread function (1 sigma).
        read_noise_dn: Noise of a pixel, grey values (1 sigma).
    """

    def __init__(
        self, config: DetectionConfig, *, spot_sigma_px: float, read_noise_dn: float
    ) -> None:
        self._config = config
        self._radius = math.ceil(4.0 * spot_sigma_px) + 1
        self._noise_dn = max(read_noise_dn, 0.5)
        self._variance_px2 = spot_sigma_px**2
        axis = np.arange(2 * self._radius + 1) - float(self._radius)
        self._powers = np.stack([np.ones_like(axis), axis, axis * axis], axis=1).astype(np.float32)
        self._border = math.ceil(3.0 * spot_sigma_px)

    def sigma_px(self, peaks_dn: FloatArray) -> FloatArray:
        """Return the standard deviation of a spot's place per axis, px.

        The noise part is that of a centroid over a patch of N x N pixels of noise s: each pixel
        pulls with its distance, so s sqrt(N^4 / 12) over the sum of the light, 2 pi sigma^2 peak.
        Subtracting three sigma of noise leaves a small part of it (measured: below one fifth).

        Args:
            peaks_dn: Peaks above the background, grey values.
        """
        patch = 2.0 * self._radius + 1.0
        pull = 0.2 * self._noise_dn * patch * patch / math.sqrt(12.0)
        noise_px = pull / (2.0 * math.pi * self._variance_px2 * np.maximum(peaks_dn, 1.0))
        sigma: FloatArray = np.hypot(self._config.centroid_sigma_px, noise_px)
        return sigma

    def background_dn(self, image: Image) -> float:
        """Return the background of a frame from a sparse sample, grey values."""
        return float(image[::_BACKGROUND_STEP, ::_BACKGROUND_STEP].mean())

    def in_windows(
        self,
        image: Image,
        centres_px: Sequence[Sequence[float]],
        halves_px: Sequence[int],
        *,
        skip_px: Sequence[float] | None = None,
    ) -> Spots:
        """Find the brightest spot in each of several windows.

        Args:
            image: (height, width) grey values.
            centres_px: Where each window is centred, (u, v).
            halves_px: Half-width of each.
            skip_px: A light at (u, v) to pass over, or None.

        Returns:
            One spot per window; `good` is false where there is none.
        """
        height, width = image.shape
        corners: list[tuple[int, int]] = []
        for (u, v), half in zip(centres_px, halves_px, strict=True):
            left, top = max(0, int(u) - half), max(0, int(v) - half)
            window = image[top : max(0, int(v) + half + 1), left : max(0, int(u) + half + 1)]
            if window.size == 0 or left >= width or top >= height:
                corners.append((-1, -1))
                continue
            if skip_px is not None:
                window = self._without(window, skip_px[0] - left, skip_px[1] - top)
            _, _, _, place = cv2.minMaxLoc(window)
            corners.append((left + place[0], top + place[1]))
        return self._refine(image, corners, self.background_dn(image))

    def _without(self, window: Image, u: float, v: float) -> Image:
        """Return a copy of a window with one light painted over."""
        window = window.copy()
        top, left = max(0, int(v) - self._radius), max(0, int(u) - self._radius)
        window[top : int(v) + self._radius + 1, left : int(u) + self._radius + 1] = 0
        return window

    def in_frame(self, image: Image) -> Spots:
        """Find the brightest LED-like spots of a whole frame, brightest first.

        Returns:
            At most `maximum_spots` spots, all good; none where the image is overexposed.
        """
        background_dn = self.background_dn(image)
        level_dn = background_dn + max(self._config.minimum_peak_dn, 6.0 * self._noise_dn)
        _, mask = cv2.threshold(image, min(level_dn, 255.0), 1, cv2.THRESH_BINARY)
        bright = cv2.countNonZero(mask)
        if not 0 < bright <= _MAXIMUM_BRIGHT:
            return Spots(np.empty((0, 2)), np.empty(0), np.empty(0, dtype=np.bool_))
        places = cv2.findNonZero(mask).reshape(-1, 2)
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
        keep = np.flatnonzero(spots.good)[: self._config.maximum_spots]
        return Spots(spots.pixels_px[keep], spots.peaks_dn[keep], spots.good[keep])

    def _refine(self, image: Image, corners: list[tuple[int, int]], background_dn: float) -> Spots:
        """Return the centroids of patches around peaks, with the tests of their shape."""
        radius, size = self._radius, 2 * self._radius + 1
        height, width = image.shape
        patches = np.zeros((len(corners), size, size), dtype=np.float32)
        centres = np.empty((len(corners), 2))
        for index, (u, v) in enumerate(corners):
            left, top = (
                min(max(u - radius, 0), width - size),
                min(max(v - radius, 0), height - size),
            )
            centres[index] = left + radius, top + radius
            if u >= 0:
                patches[index] = image[top : top + size, left : left + size]
        peaks = patches.max(axis=(1, 2))
        patches -= background_dn + _HOT_PIXEL_SIGMA * self._noise_dn
        np.maximum(patches, 0.0, out=patches)
        columns = patches.sum(axis=1) @ self._powers
        rows = patches.sum(axis=2) @ self._powers
        light = np.maximum(columns[:, 0], 1e-3)
        shift_u, shift_v = columns[:, 1] / light, rows[:, 1] / light
        spread = (columns[:, 2] + rows[:, 2]) / light - shift_u**2 - shift_v**2
        pixels = centres
        pixels[:, 0] += shift_u
        pixels[:, 1] += shift_v
        contrast = peaks - background_dn
        good = (
            (contrast >= self._config.minimum_peak_dn)
            & (light >= _HOT_PIXEL_SHARE * 2.0 * math.pi * self._variance_px2 * contrast)
            & (spread <= 2.0 * _WIDE_FACTOR**2 * self._variance_px2)
            & (pixels >= self._border).all(axis=1)
            & (pixels[:, 0] <= width - 1 - self._border)
            & (pixels[:, 1] <= height - 1 - self._border)
        )
        return Spots(pixels, peaks.astype(np.float64), good)
