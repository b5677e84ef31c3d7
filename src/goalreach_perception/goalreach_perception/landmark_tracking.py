"""Data association while tracking: spots in windows around predicted LEDs, gated."""

from __future__ import annotations

from itertools import combinations
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.tags import CORNERS
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.detection import SpotDetector, Spots
from goalreach_perception.local_spots import Image
from goalreach_perception.measurement_model import BEHIND_M, Optics
from goalreach_perception.measurement_prediction import Prediction, innovation_distance2
from goalreach_perception.pose_filter import PoseFilter

_WINDOW_SIGMAS = 4.0
_LARGEST_HALF_PX = 80
_BORDER_PX = 6.0
"""A spot nearer to the border may be cut off. Chosen."""
_MERGED_PX = 4.0
"""Two LEDs closer than this are one ambiguous spot, assigned to neither. Chosen."""


class MatchedLeds(NamedTuple):
    """Spots of one image with the LEDs they are assigned to.

    Attributes:
        leds: (k,) indices of the LEDs.
        spots: The k spots.
        pixels_px: (k, 2) their undistorted centres.
        expected: Number of LEDs that the prediction places in the image.
    """

    leds: NDArray[np.intp]
    spots: Spots
    pixels_px: FloatArray
    expected: int

    @property
    def measured(self) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
        """LEDs, pixels and standard deviations, as `PoseFilter.correct` takes them."""
        return self.leds, self.pixels_px, self.spots.sigmas_px

    def concatenated(self, other: MatchedLeds) -> MatchedLeds:
        """Return these followed by others of the same image."""
        if len(other.leds) == 0:
            return self
        return MatchedLeds(
            np.concatenate([self.leds, other.leds]),
            self.spots.concatenated(other.spots),
            np.concatenate([self.pixels_px, other.pixels_px]),
            self.expected + other.expected,
        )

    def select(self, rows: list[int]) -> MatchedLeds:
        """Return some of the rows."""
        return MatchedLeds(
            self.leds[rows], self.spots.select(rows), self.pixels_px[rows], self.expected
        )


def correct_by(
    state: PoseFilter, prediction: Prediction, found: MatchedLeds, led_count: int
) -> MatchedLeds | None:
    """Correct a filter by an image, without the LED or tag that makes it fail the joint gate.

    The corners of tags are the landmarks from `led_count` on. Returns what has corrected the
    filter; None if nothing was found or it fails the gate.
    """
    count = len(found.leds)
    if count == 0:
        return None
    if state.correct(prediction, *found.measured) <= state.joint_gate(count):
        return found
    beyond = found.leds - led_count
    names = np.where(beyond < 0, beyond, beyond // CORNERS)
    if count <= 2 or len(set(names)) == 1:  # noqa: PLR2004 - which of two is wrong is undecidable
        return None
    parts = [found.select(np.flatnonzero(names != name).tolist()) for name in set(names.tolist())]

    def rank(part: MatchedLeds) -> tuple[bool, float]:  # of a tag and a light the light is wrong
        excess = innovation_distance2(prediction, *part.measured) - 2.0 * len(part.leds)
        return len(parts) == 2 and len(part.leds) == 1, excess  # noqa: PLR2004

    best = min(parts, key=rank)
    fits = state.correct(prediction, *best.measured) <= state.joint_gate(len(best.leds))
    return best if fits else None


def find_predicted(
    image: Image,
    prediction: Prediction,
    *,
    detector: SpotDetector,
    optics: Optics,
    gate: float,
    window_half_px: int,
    streak_px: float,
) -> MatchedLeds:
    """Detect LEDs in windows, of at least a half-width, around their predicted pixels.

    If the brightest spot of a window fails the gate, the largest squared Mahalanobis distance with
    2 degrees of freedom, the second brightest is tried. Motion may draw a spot out to a line of at
    most `streak_px`.
    """
    leds, centres, halves, expected = _windows(prediction, optics, image.shape, window_half_px)
    spots = detector.in_windows(image, centres, halves, streak_px=streak_px)
    pixels = optics.undistort(spots.pixels_px)
    near = _near(prediction, leds, spots, pixels.tolist(), gate)
    rows = [row for row in range(len(leds)) if spots.bright[row] and row not in near]
    if rows:
        again = [centres[row] for row in rows], [halves[row] for row in rows]
        skip_px = spots.pixels_px[rows].tolist()
        others = detector.in_windows(image, *again, skip_px=skip_px, streak_px=streak_px)
        spots = spots.concatenated(others)
        pixels = optics.undistort(spots.pixels_px)
        leds += [leds[row] for row in rows]
        near = _near(prediction, leds, spots, pixels.tolist(), gate)
    found = MatchedLeds(np.array(leds, dtype=np.intp), spots, pixels, expected)
    near = _apart(near, pixels)
    return found if len(near) == len(leds) else found.select(near)


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
    expected, most = 0, max(shape)
    for led, (u, v) in enumerate(pixels):
        spread = _WINDOW_SIGMAS * math.sqrt(max(variances[2 * led], variances[2 * led + 1]))
        if not (depths[led] > BEHIND_M and spread < most):
            continue
        if -spread < u < width + spread and -spread < v < height + spread:
            leds.append(led)
            halves.append(min(int(spread) + half_px, _LARGEST_HALF_PX))
            edge = spread + _BORDER_PX
            expected += edge < u < width - edge and edge < v < height - edge
    return leds, [pixels[led] for led in leds], halves, expected


def tags_near(tags: MatchedLeds, prediction: Prediction, gate: float) -> MatchedLeds:
    """Return the tags that are where they should be; the others are expected there.

    The gate is the largest squared Mahalanobis distance of a corner, 2 degrees of freedom.
    """
    leds, pixels = tags.leds.tolist(), tags.pixels_px.tolist()
    near = set(_near(prediction, leds, tags.spots, pixels, gate))
    whole = [row for row in near if near.issuperset(range(row - row % 4, row - row % 4 + 4))]
    return tags.select(sorted(whole))


def _near(
    prediction: Prediction,
    leds: list[int],
    spots: Spots,
    pixels_px: list[list[float]],
    gate: float,
) -> list[int]:
    """Return the rows of the LED-like spots within the gate."""
    covariance, expected = prediction.covariance.tolist(), prediction.pixels_px.tolist()
    rows: list[int] = []
    measured = zip(leds, spots.led_like, pixels_px, spots.sigmas_px.tolist(), strict=True)
    for row, (led, good, (u, v), sigma) in enumerate(measured):
        if not good:
            continue
        along, down = covariance[2 * led], covariance[2 * led + 1]
        variance = sigma**2
        uu, uv, vv = along[2 * led] + variance, along[2 * led + 1], down[2 * led + 1] + variance
        du, dv = u - expected[led][0], v - expected[led][1]
        distance2 = (vv * du * du - 2.0 * uv * du * dv + uu * dv * dv) / (uu * vv - uv * uv)
        if distance2 <= gate:
            rows.append(row)
    return rows


def _apart(rows: list[int], pixels_px: FloatArray) -> list[int]:
    """Return the rows whose spot is not the spot of another row too."""
    places = pixels_px.tolist()
    merged: set[int] = set()
    for one, other in combinations(rows, 2):
        (u1, v1), (u2, v2) = places[one], places[other]
        if math.hypot(u1 - u2, v1 - v2) <= _MERGED_PX:
            merged |= {one, other}
    return [row for row in rows if row not in merged] if merged else rows
