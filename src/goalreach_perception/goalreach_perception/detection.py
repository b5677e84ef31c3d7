"""Sub-pixel detection of LED spots, in windows around predictions or in the whole frame.

The centre of a spot is its intensity-weighted centroid in a small patch around its peak, with
background and noise subtracted. Rejected are hot pixels (too little light for their peak),
overlapping spots (too wide), and spots cut off by the border of the image.

A spot as this lens makes it of a point, on the background of the whole image, is measured at once.
What is not like that is measured against its own surround by `local_spots`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import repeat, starmap
import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.local_spots import (
    ALONE,
    LIKELY,
    NARROW_SIGMA_PX,
    TRACKED,
    Corner,
    Image,
    LocalSpotMeter,
    Window,
    brighter_than,
    brightest_pixel,
    cut_patches,
    cut_window,
    moment_sums,
    peaks_that_stand_out,
    stand_out,
)


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
    maximum_spots: int = parameter(5, 'Most spots of a whole frame (chosen)', within=(3, 8))
    window_half_px: int = parameter(
        20, 'Smallest half-width of a tracking window, px (chosen)', within=(8, 80)
    )
    longest_exposure_s: float = parameter(
        0.02,
        'Longest exposure, s: in that time a moving image draws a spot out to a line (chosen)',
        within=(0.0, 0.2),
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

    @classmethod
    def unknown(cls, count: int) -> Spots:
        """Return spots of which nothing is known."""
        no, at_px = [False] * count, np.zeros((count, 2))
        return cls(at_px, np.array([1.0] * count), [0] * count, no, no.copy())

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
_MAXIMUM_BRIGHT = 1500
"""An image with more bright pixels is overexposed. Chosen."""
_NARROW = 0.3
"""A spot of less variance, relative to the lens, is sampled too coarsely. Chosen."""
_SHARP, _SHARP_SIGMA_PX = 0.8, 0.05
"""A saturated spot of less variance, relative to the lens, has edges that fall between pixels.
Measured in the MuJoCo world with a blur of 0.3 px: 0.03 to 0.045 px per axis."""
_LEAST_NOISE = 6.0
"""Least contrast of what may be a spot, in sigmas of the noise. Chosen."""
_SAME_BACKGROUND = 2.0
"""Backgrounds closer than this are the same, in sigmas of the noise. Chosen."""
_SMOOTH_PX = (3, 3)
_LOCAL_CANDIDATES = 16
"""Most places of an uneven frame that are measured. Chosen."""


class _Frame(NamedTuple):
    """An image, its background or NaN, the longest line of a spot, and what measures there."""

    image: Image
    background_dn: float
    streak_px: float
    meter: LocalSpotMeter


class SpotDetector:
    """Finds LEDs in mono8 images.

    Where the last windows had an uneven background, those of the next image are measured against
    their surround at once.
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
        self._is_uneven = False
        radii = (self._near, self._radius)
        self._sums = {radius: moment_sums(radius, self._near) for radius in radii}
        self._least_dn, self._narrow_px2 = config.minimum_peak_dn, _NARROW * self._variance_px2
        sigma_px, noise_dn = config.centroid_sigma_px, self._noise_dn
        self._sampling_px = sigma_px
        meter = partial(LocalSpotMeter, centroid_sigma_px=sigma_px, noise_dn=noise_dn)
        self._meters = {repeated: meter(repeated=repeated) for repeated in (ALONE, TRACKED)}

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
        streak_px: float = 0.0,
    ) -> Spots:
        """Find the brightest spot of each window; `bright` and `led_like` are false without one.

        Args:
            image: (height, width) grey values.
            centres_px: Centre (u, v) of each window.
            halves_px: Half-width of each.
            skip_px: A spot (u, v) to ignore in each window; empty to ignore none.
            streak_px: Longest line that motion may draw a spot out to.
        """
        was_uneven, self._is_uneven = self._is_uneven, False
        background_dn = math.nan if was_uneven else self.background_dn(image)
        windows = [*map(cut_window, repeat(image), centres_px, halves_px)]
        windows[: len(skip_px)] = map(self._masked, windows, skip_px)
        corners = [*starmap(brightest_pixel, windows)]
        if was_uneven:
            rows = [row for row, (pixels, *_) in enumerate(windows) if pixels.size]
            spots = Spots.unknown(len(corners))
        else:
            spots, sure = self._refine(image, corners, background_dn)
            if all(sure):
                return spots
            least_dn = background_dn + _LEAST_NOISE * self._noise_dn
            rows = [k for k, peak in enumerate(spots.peaks_dn) if not sure[k] and peak > least_dn]
        frame = _Frame(image, background_dn, streak_px, self._meters[TRACKED])
        for row in (rows := self._measure(frame, spots, corners, rows)):
            smooth = cv2.blur(windows[row][0], _SMOOTH_PX)
            corners[row] = brightest_pixel(stand_out(smooth), *windows[row][1:])
        likely = frame.meter.outstanding(image, [corners[row] for row in rows])
        self._measure(frame, spots, corners, [rows[k] for k in likely])
        return spots

    def _masked(self, window: Window, skip_px: Sequence[float]) -> Window:
        """Return a copy of a window with one spot masked by the least of its grey values."""
        pixels, left, top = window
        pixels, u, v = pixels.copy(), int(skip_px[0] - left), int(skip_px[1] - top)
        rows, columns = (
            slice(max(0, at - self._radius), max(0, at + self._radius + 1)) for at in (v, u)
        )
        masked = pixels[rows, columns]
        if masked.size:
            masked[:] = pixels.min()
        return pixels, left, top

    def _measure(
        self, frame: _Frame, spots: Spots, corners: list[Corner], rows: list[int]
    ) -> list[int]:
        """Measure some spots against their surround, in place; return those not like an LED.

        A spot that was like an LED stays as it is where its surround is the background.
        """
        if not rows:
            return rows
        found = frame.meter.measure(frame.image, [corners[row] for row in rows], frame.streak_px)
        for row, local in zip(rows, found, strict=True):
            same = local.even and self._is_background(local.background_dn, frame)
            if spots.led_like[row] and same:
                continue
            self._is_uneven |= local.led_like and not same
            spots.led_like[row] = local.led_like
            spots.bright[row] = spots.bright[row] or local.bright
            if local.led_like:
                spots.pixels_px[row] = local.u_px, local.v_px
                spots.sigmas_px[row], spots.peaks_dn[row] = local.sigma_px, round(local.peak_dn)
        return [row for row in rows if not spots.led_like[row]]

    def _is_background(self, surround_dn: float, frame: _Frame) -> bool:
        """Return whether a surround is the background of a frame, which is read when needed."""
        known = not math.isnan(frame.background_dn)
        background_dn = frame.background_dn if known else self.background_dn(frame.image)
        return abs(surround_dn - background_dn) <= _SAME_BACKGROUND * self._noise_dn

    def in_frame(self, image: Image, *, streak_px: float = 0.0) -> Spots:
        """Find the brightest LED-like spots of a whole frame, brightest first.

        Returns:
            At most `maximum_spots` LED-like spots.
        """
        frame = _Frame(image, self.background_dn(image), streak_px, self._meters[ALONE])
        level_dn = frame.background_dn + _LEAST_NOISE * self._noise_dn
        places = brighter_than(image, min(level_dn, 255.0), _MAXIMUM_BRIGHT)
        corners: list[Corner] = []
        if len(places) <= _MAXIMUM_BRIGHT:
            corners = self._brightest(image, places, 2 * self._config.maximum_spots)
        spots, sure = self._refine(image, corners, frame.background_dn)
        is_lit = len(places) > _MAXIMUM_BRIGHT
        if is_lit or not all(sure):
            known = spots.select([k for k, is_led in enumerate(sure) if is_led])
            spots = self._uneven(frame, known, 1.0 if is_lit else LIKELY)
        return spots.select([*range(len(spots.peaks_dn))][: self._config.maximum_spots])

    def _brightest(self, image: Image, places: NDArray[np.intp], count: int) -> list[Corner]:
        """Return the brightest of some pixels, each apart from the others."""
        values = image[places[:, 1], places[:, 0]].astype(np.int16)
        corners: list[Corner] = []
        while len(values) and len(corners) < count:
            best = int(values.argmax())
            if values[best] < 0:
                break
            u, v = places[best]
            corners.append((int(u), int(v)))
            values[np.abs(places - places[best]).max(axis=1) <= self._radius] = -1
        return corners

    def _uneven(self, frame: _Frame, known: Spots, part: float) -> Spots:
        """Return the spots of a frame with an uneven background, or of LEDs that are no points."""
        corners = peaks_that_stand_out(frame.image, _LOCAL_CANDIDATES, 0.25 * self._least_dn)
        corners = [*frame.meter.outstanding(frame.image, corners, part).values()]
        spots, _ = self._refine(frame.image, corners, frame.background_dn)
        self._measure(frame, spots, corners, [*range(len(corners))])
        spots = known.concatenated(spots)
        leds = [row for row, is_led in enumerate(spots.led_like) if is_led]
        rows: list[int] = []
        for row in sorted(leds, key=lambda k: -spots.peaks_dn[k]):
            apart_px = np.abs(spots.pixels_px[rows] - spots.pixels_px[row]).max(axis=1)
            if (apart_px > self._near).all():
                rows.append(row)
        return spots.select(rows)

    def _refine(
        self, image: Image, corners: list[Corner], background_dn: float
    ) -> tuple[Spots, list[bool]]:
        """Return the centroids of patches around peaks, test their shape and their surround.

        A spot is cut off if its edge, at twice its standard deviation for a disc of light, lies
        beyond the border. Read noise displaces a centroid by noise / peak for any width of the
        spot, as measured on rendered spots (the Cramer-Rao bound of a Gaussian spot is
        sqrt(2 / pi) of that).
        """
        height, width = image.shape
        pixels: list[tuple[float, float]] = []
        sigmas: list[float] = []
        good: list[bool] = []
        clean: list[bool] = []
        noise_dn, narrow_px2, least_px = self._noise_dn, self._narrow_px2, self._border
        peaks = [int(image[v, u]) if u >= 0 else 0 for u, v in corners]
        moments = self._moments(image, corners, peaks, background_dn)
        for (u, v), peak, row in zip(corners, peaks, moments, strict=True):
            light, sum_u, sum_v, sum_2, border = row[5:] if peak >= _SATURATED_DN else row[:5]
            light = light or 1e-3
            contrast = peak - background_dn
            shift_u, shift_v = sum_u / light, sum_v / light
            u_px, v_px = u + shift_u, v + shift_v
            pixels.append((u_px, v_px))
            variance = 0.5 * (sum_2 / light - shift_u * shift_u - shift_v * shift_v)
            reach = max(least_px, 2.0 * math.sqrt(max(variance, 0.0)) + 1.0)
            inside = reach <= u_px <= width - 1 - reach and reach <= v_px <= height - 1 - reach
            is_led = inside and self._is_led_like(peak, contrast, light, variance)
            good.append(is_led)
            clean.append(is_led and border == 0.0)
            sharp = peak >= _SATURATED_DN and variance < _SHARP * self._variance_px2
            sampling = _SHARP_SIGMA_PX if sharp else self._sampling_px
            sampling = NARROW_SIGMA_PX if variance < narrow_px2 else sampling
            sigmas.append(math.hypot(sampling, noise_dn / max(contrast, 1.0)))
        bright = [peak >= background_dn + self._least_dn for peak in peaks]
        spots = Spots(np.array(pixels).reshape(-1, 2), np.array(sigmas), peaks, bright, good)
        return spots, clean

    def _moments(
        self, image: Image, corners: list[Corner], peaks_dn: list[int], background_dn: float
    ) -> list[list[float]]:
        """Return the `moment_sums` around each peak; of a larger patch if one is saturated."""
        radius = self._radius if max(peaks_dn, default=0) >= _SATURATED_DN else self._near
        patches = cut_patches(image, corners, radius)
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
        if contrast_dn < self._least_dn or cut >= 1.0:
            return False
        expected = self._light_per_peak * contrast_dn * (1.0 - cut + cut * math.log(cut))
        widest = _WIDEST_SATURATED if peak_dn >= _SATURATED_DN else _WIDEST
        return light >= _HOT_PIXEL_SHARE * expected and variance_px2 <= widest * self._variance_px2
