"""LEDs of a tracking frame: spots in windows around the predictions, named and gated."""

from __future__ import annotations

from itertools import combinations
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray
from goalreach_perception.detection import Image, SpotDetector, Spots
from goalreach_perception.measurement_model import Optics
from goalreach_perception.measurement_prediction import Prediction, innovation_distance2
from goalreach_perception.pose_filter import PoseFilter

_WINDOW_SIGMAS = 4.0
_LARGEST_HALF_PX = 80
_BEHIND_M = 0.06
"""At this depth an LED is not in front of the camera: just above the model's floor."""
_BORDER_PX = 6.0
"""Nearer to the border than this a spot may be cut. Chosen."""
_MERGED_PX = 4.0
"""Two LEDs found nearer together than this are one spot, and of neither. Chosen."""


class MatchedLeds(NamedTuple):
    """The LEDs found in one image.

    Attributes:
        leds: (k,) which.
        spots: Where in the image, k of them.
        pixels_px: (k, 2) the same with the lens's distortion removed.
        expected: How many LEDs should have been seen, by the prediction.
    """

    leds: NDArray[np.intp]
    spots: Spots
    pixels_px: FloatArray
    expected: int

    @property
    def measured(self) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
        """Which LEDs, where, and how sure: what the filter takes."""
        return self.leds, self.pixels_px, self.spots.sigmas_px

    def matched(self, rows: list[int], leds: NDArray[np.intp]) -> MatchedLeds:
        """Return some of the lights under the names of LEDs."""
        return MatchedLeds(leds, self.spots.select(rows), self.pixels_px[rows], len(rows))

    def select(self, rows: list[int]) -> MatchedLeds:
        """Return some of them."""
        return MatchedLeds(
            self.leds[rows], self.spots.select(rows), self.pixels_px[rows], self.expected
        )


def correct_by(state: PoseFilter, prediction: Prediction, seen: MatchedLeds) -> MatchedLeds | None:
    """Correct a filter by the LEDs of an image, or by all but one where only those fit together.

    Args:
        state: The filter.
        prediction: What it expected of this image.
        seen: What was found.

    Returns:
        The LEDs that were used; None where there are none or they do not fit.
    """
    count = len(seen.leds)
    if count == 0:
        return None
    if state.correct(prediction, *seen.measured) <= state.joint_gate:
        return seen
    if count <= 2:  # noqa: PLR2004 - of two one cannot tell which is wrong
        return None
    parts = [seen.select([row for row in range(count) if row != out]) for out in range(count)]
    best = min(parts, key=lambda part: innovation_distance2(prediction, *part.measured))
    return best if state.correct(prediction, *best.measured) <= state.joint_gate else None


def find_predicted(
    image: Image,
    prediction: Prediction,
    *,
    detector: SpotDetector,
    optics: Optics,
    gate: float,
    window_half_px: int,
) -> MatchedLeds:
    """Return the LEDs that are where the filter expects them.

    Where the brightest light of a window is not the LED, the second brightest is looked at.

    Args:
        image: (height, width) grey values.
        prediction: Where the LEDs should be.
        detector: Finds spots.
        optics: The lens.
        gate: Largest squared distance of a spot from its prediction, 2 degrees of freedom.
        window_half_px: Smallest half-width of a window.
    """
    leds, centres, halves, expected = _windows(prediction, optics, image.shape, window_half_px)
    spots = detector.in_windows(image, centres, halves)
    pixels = optics.undistort(spots.pixels_px)
    near = _near(prediction, leds, spots, pixels, gate)
    rows = [row for row in range(len(leds)) if spots.bright[row] and row not in near]
    if rows:
        others = detector.in_windows(
            image,
            [centres[row] for row in rows],
            [halves[row] for row in rows],
            skip_px=spots.pixels_px[rows].tolist(),
        )
        spots = spots.concatenated(others)
        pixels = optics.undistort(spots.pixels_px)
        leds += [leds[row] for row in rows]
        near = _near(prediction, leds, spots, pixels, gate)
    near = _apart(near, pixels)
    if len(near) == len(leds):
        return MatchedLeds(np.array(leds, dtype=np.intp), spots, pixels, expected)
    named = np.array([leds[row] for row in near], dtype=np.intp)
    return MatchedLeds(named, spots.select(near), pixels[near], expected)


def _windows(
    prediction: Prediction, optics: Optics, shape: tuple[int, ...], half_px: int
) -> tuple[list[int], list[list[float]], list[int], int]:
    """Return the LEDs that may be in the image, their windows, and how many must be in it."""
    height, width = shape
    variances = prediction.covariance.diagonal().tolist()
    pixels = optics.distort(prediction.pixels_px).tolist()
    depths = prediction.depth_m
    leds: list[int] = []
    halves: list[int] = []
    expected = 0
    for led, (u, v) in enumerate(pixels):
        spread = _WINDOW_SIGMAS * math.sqrt(max(variances[2 * led], variances[2 * led + 1]))
        if not (depths[led] > _BEHIND_M and spread < max(shape)):
            continue
        if -spread < u < width + spread and -spread < v < height + spread:
            leds.append(led)
            halves.append(min(int(spread) + half_px, _LARGEST_HALF_PX))
            edge = spread + _BORDER_PX
            expected += edge < u < width - edge and edge < v < height - edge
    return leds, [pixels[led] for led in leds], halves, expected


def _near(
    prediction: Prediction, leds: list[int], spots: Spots, pixels_px: FloatArray, gate: float
) -> list[int]:
    """Return the rows of the spots that look like LEDs and lie within the gate.

    The squared distance of a spot from its prediction has 2 degrees of freedom.
    """
    covariance, expected = prediction.covariance.tolist(), prediction.pixels_px.tolist()
    pixels, sigmas = pixels_px.tolist(), spots.sigmas_px.tolist()
    rows: list[int] = []
    for row, (led, good) in enumerate(zip(leds, spots.led_like, strict=True)):
        if not good:
            continue
        along, down = covariance[2 * led], covariance[2 * led + 1]
        variance = sigmas[row] ** 2
        uu, uv, vv = along[2 * led] + variance, along[2 * led + 1], down[2 * led + 1] + variance
        du, dv = pixels[row][0] - expected[led][0], pixels[row][1] - expected[led][1]
        distance2 = (vv * du * du - 2.0 * uv * du * dv + uu * dv * dv) / (uu * vv - uv * uv)
        if distance2 <= gate:
            rows.append(row)
    return rows


def _apart(rows: list[int], pixels_px: FloatArray) -> list[int]:
    """Return the rows whose spot is not another row's spot as well."""
    places = [pixels_px[row].tolist() for row in rows]
    merged: set[int] = set()
    for (one, (u1, v1)), (other, (u2, v2)) in combinations(zip(rows, places, strict=True), 2):
        if math.hypot(u1 - u2, v1 - v2) <= _MERGED_PX:
            merged |= {one, other}
    return [row for row in rows if row not in merged] if merged else rows
