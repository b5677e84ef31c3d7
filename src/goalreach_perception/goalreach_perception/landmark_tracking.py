"""LEDs of a tracking frame: spots in windows around the predictions, named and gated."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray
from goalreach_perception.detection import Image, SpotDetector
from goalreach_perception.optics import Optics
from goalreach_perception.pose_filter import Prediction

__all__ = ['SeenLeds', 'find_predicted']

_WINDOW_SIGMAS = 4.0
_LARGEST_HALF_PX = 80
_MERGED_PX = 4.0
"""Two LEDs found nearer together than this are one spot, and of neither. Chosen."""


@dataclass(frozen=True)
class SeenLeds:
    """The LEDs found in one image.

    Attributes:
        leds: (k,) which.
        raw_px: (k, 2) where in the image.
        pixels_px: (k, 2) the same with the lens's distortion removed.
        sigmas_px: (k,) standard deviation per axis.
        peaks_dn: (k,) grey values.
        expected: (n,) which LEDs should have been seen, by the prediction.
    """

    leds: NDArray[np.intp]
    raw_px: FloatArray
    pixels_px: FloatArray
    sigmas_px: FloatArray
    peaks_dn: FloatArray
    expected: list[bool]


def find_predicted(
    image: Image,
    prediction: Prediction,
    *,
    detector: SpotDetector,
    optics: Optics,
    gate: float,
    window_half_px: int,
) -> SeenLeds:
    """Return the LEDs that are where the filter expects them.

    Args:
        image: (height, width) grey values.
        prediction: Where the LEDs should be.
        detector: Finds spots.
        optics: The lens.
        gate: Largest squared distance of a spot from its prediction, 2 degrees of freedom.
        window_half_px: Smallest half-width of a window.
    """
    height, width = image.shape
    variances = prediction.covariance.diagonal().tolist()
    centres = optics.to_raw(prediction.pixels_px).tolist()
    depths = prediction.depth_m.tolist()
    windows: list[int] = []
    halves: list[int] = []
    expected = [False] * len(centres)
    for led, (u, v) in enumerate(centres):
        spread = _WINDOW_SIGMAS * math.sqrt(max(variances[2 * led], variances[2 * led + 1]))
        if not (depths[led] > 0.06 and spread < 1e4):  # noqa: PLR2004 - not just behind
            continue
        half = min(int(spread) + window_half_px, _LARGEST_HALF_PX)
        if -spread < u < width + spread and -spread < v < height + spread:
            windows.append(led)
            halves.append(half)
            edge = spread + 6.0
            expected[led] = edge < u < width - edge and edge < v < height - edge
    spots = detector.in_windows(image, [centres[led] for led in windows], halves)
    sigmas = detector.sigma_px(spots.peaks_dn)
    ideal = optics.to_ideal(spots.pixels_px)
    kept = []
    for row, led in enumerate(windows):
        near = spots.good[row] and _distance2(prediction, led, ideal[row], sigmas[row]) <= gate
        if not near and spots.peaks_dn[row] > detector.background_dn(image) + 10.0:
            again = detector.in_windows(
                image, [centres[led]], [halves[row]], skip_px=spots.pixels_px[row].tolist()
            )
            spots.pixels_px[row], spots.peaks_dn[row] = again.pixels_px[0], again.peaks_dn[0]
            sigmas[row] = detector.sigma_px(again.peaks_dn)[0]
            ideal[row] = optics.to_ideal(again.pixels_px)[0]
            near = again.good[0] and _distance2(prediction, led, ideal[row], sigmas[row]) <= gate
        if near:
            kept.append(row)
    kept = _apart(kept, ideal)
    leds = np.array([windows[row] for row in kept], dtype=np.intp)
    return SeenLeds(
        leds, spots.pixels_px[kept], ideal[kept], sigmas[kept], spots.peaks_dn[kept], expected
    )


def _distance2(prediction: Prediction, led: int, pixel: FloatArray, sigma_px: float) -> float:
    """Return the squared distance of a spot from its prediction, 2 degrees of freedom."""
    du, dv = (pixel - prediction.pixels_px[led]).tolist()
    block = prediction.covariance[2 * led : 2 * led + 2, 2 * led : 2 * led + 2]
    (uu, uv), (_, vv) = block.tolist()
    uu, vv = uu + sigma_px * sigma_px, vv + sigma_px * sigma_px
    determinant = uu * vv - uv * uv
    return float((vv * du * du - 2.0 * uv * du * dv + uu * dv * dv) / determinant)


def _apart(rows: list[int], pixels_px: FloatArray) -> list[int]:
    """Return the rows whose spot is not another row's spot as well."""
    if len(rows) <= 1:
        return rows
    places = [pixels_px[row].tolist() for row in rows]
    return [
        row
        for i, row in enumerate(rows)
        if all(
            i == j or math.hypot(places[i][0] - u, places[i][1] - v) > _MERGED_PX
            for j, (u, v) in enumerate(places)
        )
    ]
