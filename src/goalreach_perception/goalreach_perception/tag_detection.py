"""Detection of AprilTags: found and decoded by OpenCV, their corners by a model of the whole tag.

The corners are those of the projection of the known pattern that fits the pixels best: a
homography, given by its four corners, with brightness, contrast and blur as further unknowns, by
Gauss-Newton. Covariances follow from the residuals. Corners of contours, which OpenCV refines,
lie up to a pixel inside the square where the image is not sharp.
"""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Final, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.tags import CORNERS, Tag, tag_dictionary, tag_pattern
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.detection import Spots
from goalreach_perception.landmark_tracking import MatchedLeds
from goalreach_perception.local_spots import Image
from goalreach_perception.measurement_model import Optics

_ITERATIONS: Final = 4
_FINE: Final = 2
"""Samples of the model along a pixel. Chosen: with one, corners err twice as much."""
_SEEN_OUTSIDE: Final = 0.45
"""Part of the white margin, one cell wide, that is compared with the model. Chosen: beyond it,
blur brings in what surrounds the tag."""
_MOST_PIXELS: Final = 6000
_RANKS: Final = (0.7548776662, 0.5698402910)
"""Multiples of these, modulo 1, put the pixels of an image into an order of which every first part
is spread evenly over rows and columns: the powers of the inverse of the plastic number."""
_LARGEST_STEP_PX: Final = 2.0
_LEAST_EDGE_PX: Final = 14.0
"""Shortest edge of a tag whose corners are used. Chosen: cells of 1.5 px and more."""
_WINDOWS_PX: Final = (13, 33)
"""Sides of the windows of OpenCV's thresholds. Chosen: smaller ones find mostly texture."""
_LEAST_CONTRAST_DN: Final = 15.0
_BLURS_PX2: Final = (0.1, 9.0)
_UNIT: Final = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
_SLOPE: Final = _FINE * np.array([[-0.5, 0.0, 0.5]], np.float32)


class TagFit(NamedTuple):
    """Corners of a tag in an image.

    Attributes:
        corners_px: (4, 2) pixels (u, v), in the order of `Tag.corners_m`.
        sigmas_px: (4,) standard deviation of each, per axis: the mean of both.
        contrast_dn: White minus black.
    """

    corners_px: FloatArray
    sigmas_px: FloatArray
    contrast_dn: float


_NONE = MatchedLeds(np.empty(0, dtype=np.intp), Spots.unknown(0), np.empty((0, 2)), 0)


class TagDetector:
    """Finds the tags of an arena in mono8 images.

    Their corners are the landmarks from `led_count` on. Part of the error of a corner,
    `corner_sigma_px`, repeats from image to image.
    """

    def __init__(
        self, tags: Sequence[Tag], family: str, led_count: int, corner_sigma_px: float
    ) -> None:
        self._first = {tag.id: led_count + CORNERS * k for k, tag in enumerate(tags)}
        self._corner_sigma_px = corner_sigma_px
        if not tags:
            return
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
        parameters.adaptiveThreshWinSizeMin, parameters.adaptiveThreshWinSizeMax = _WINDOWS_PX
        parameters.adaptiveThreshWinSizeStep = _WINDOWS_PX[1] - _WINDOWS_PX[0]
        self._detector = cv2.aruco.ArucoDetector(tag_dictionary(family), parameters)
        self._patterns = {tag.id: tag_pattern(family, tag.id) for tag in tags}

    def find(self, image: Image, optics: Optics) -> MatchedLeds:
        """Return the corners of the tags in an image, whose distortion is removed beforehand."""
        if not self._first:
            return _NONE
        fits: dict[int, TagFit] = {}
        image = optics.rectify(image)
        found, ids, _ = self._detector.detectMarkers(image)
        numbers = [] if ids is None else [int(number) for number in ids.reshape(-1)]
        for number, corners in zip(numbers, found, strict=True):
            if number in self._first and numbers.count(number) == 1:
                quad_px = corners.reshape(CORNERS, 2).astype(np.float64)
                fit = fit_corners(image, quad_px, self._patterns[number])
                fits.update({} if fit is None else {self._first[number]: fit})
        pixels_px = np.array([fit.corners_px for fit in fits.values()]).reshape(-1, 2)
        sigmas_px = np.array([fit.sigmas_px for fit in fits.values()]).reshape(-1)
        sigmas_px = np.hypot(sigmas_px, self._corner_sigma_px)
        leds = np.array([first + k for first in fits for k in range(CORNERS)], dtype=np.intp)
        peaks = [round(fit.contrast_dn) for fit in fits.values() for _ in range(CORNERS)]
        sure = [True] * len(leds)
        spots = Spots(optics.distort(pixels_px), sigmas_px, peaks, sure, sure)
        return MatchedLeds(leds, spots, pixels_px, len(leds))


def circles(corners_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return centres and radii of the circles around tags with their margins."""
    quads_px = corners_px.reshape(-1, CORNERS, 2)
    centres_px = quads_px.mean(axis=1)
    return centres_px, 1.25 * np.hypot(*(quads_px - centres_px[:, None]).T).max(axis=0)


def outside(spots: Spots, tags: MatchedLeds) -> Spots:
    """Return the spots that are not cells of tags: those outside the circles around them."""
    for centre_px, reach_px in zip(*circles(tags.spots.pixels_px), strict=True):
        away_px = np.hypot(*(spots.pixels_px - centre_px).T)
        spots = spots.select(np.flatnonzero(away_px > reach_px).tolist())
    return spots


def fit_corners(image: Image, corners_px: FloatArray, pattern: Image) -> TagFit | None:
    """Return the corners of the projection of a tag that fits an image best, or None.

    The image has no distortion, the corners (4, 2) are about right, and the pattern has a pixel
    for each cell of the tag and of a margin of one.
    """
    corners_px = corners_px + 0.5 * np.sign(corners_px - corners_px.mean(axis=0))
    edges_px = np.hypot(*(np.roll(corners_px, -1, axis=0) - corners_px).T)
    cells = len(pattern) - 2
    margin = edges_px.max() / cells + 2.0
    left, top = np.maximum(corners_px.min(axis=0) - margin, 0).astype(int).tolist()
    right, bottom = (corners_px.max(axis=0) + margin).astype(int).tolist()
    part = image[top:bottom, left:right].astype(np.float32)
    if edges_px.min() < _LEAST_EDGE_PX or not np.isfinite(edges_px).all():
        return None
    scale = max(round(float(edges_px.mean()) / cells), 2)
    model = _TagModel(part, pattern, _FINE * scale)
    corners_px = corners_px - (left, top)
    try:
        for _ in range(_ITERATIONS):
            corners_px = model.step(corners_px)
    except (np.linalg.LinAlgError, cv2.error):
        return None
    variances = model.variances_px2
    inside = (corners_px > 0.0).all() and (corners_px < np.array(part.shape[::-1]) - 1.0).all()
    if not inside or model.contrast_dn < _LEAST_CONTRAST_DN or not (variances > 0.0).all():
        return None
    return TagFit(corners_px + np.array([left, top]), np.sqrt(variances), model.contrast_dn)


class _TagModel:
    """The image of a tag as a function of its corners, and its fit to a part of an image."""

    def __init__(self, part: NDArray[np.float32], pattern: Image, scale: int) -> None:
        self._part = part
        self._texture = cv2.resize(
            pattern.astype(np.float32) / 255, None, fx=scale, fy=scale,
            interpolation=cv2.INTER_NEAREST,
        )  # fmt: skip
        cells = len(pattern) - 2
        self._square = (scale * (1 + cells * _UNIT) - 0.5).astype(np.float32)
        self._reach = 0.5 + _SEEN_OUTSIDE / cells
        v, u = np.indices(part.shape)
        self._grid = np.stack([u, v, np.ones_like(u)])
        self._rank = np.dot(_RANKS, self._grid[:2].reshape(2, -1)).reshape(u.shape) % 1.0
        self._blur_px2 = 0.5
        self.contrast_dn = 0.0
        self.variances_px2: FloatArray = np.zeros(CORNERS)

    def _places(self, corners: NDArray[np.float32]) -> tuple[FloatArray, FloatArray]:
        """Return the place of each pixel in the square, 0 to 1 to the right and down."""
        right, down, depth = np.tensordot(
            np.asarray(cv2.getPerspectiveTransform(corners, _UNIT)), self._grid, axes=1
        )
        return right / depth, down / depth

    def step(self, corners_px: FloatArray) -> FloatArray:
        """Return better corners, (4, 2), by one step of Gauss-Newton."""
        corners = corners_px.astype(np.float32)
        flat = cv2.getPerspectiveTransform(self._square, (corners + 0.5) * _FINE - 0.5)
        (width, height), replicate = self._part.shape[::-1], cv2.BORDER_REPLICATE
        size = width * _FINE, height * _FINE
        drawn = cv2.warpPerspective(self._texture, flat, size, borderMode=replicate)
        drawn = cv2.GaussianBlur(drawn, (0, 0), _FINE * math.sqrt(self._blur_px2))
        right, down = self._places(corners)
        seen = np.maximum(np.abs(right - 0.5), np.abs(down - 0.5)) < self._reach
        slopes = (cv2.filter2D(drawn, -1, slope) for slope in (_SLOPE, _SLOPE.T))
        fine = (drawn, *slopes, cv2.Laplacian(drawn, cv2.CV_32F, scale=_FINE**2))
        area = cv2.INTER_AREA
        model = (cv2.resize(one, (width, height), interpolation=area) for one in fine)
        layers = (self._part, *model, right, down)
        seen &= self._rank * np.count_nonzero(seen) < _MOST_PIXELS
        pixels, drawn, across, along, curved, right, down = (
            one[seen].astype(np.float64) for one in layers
        )
        contrast = self.contrast_dn or float(np.polyfit(drawn, pixels, 1)[0])
        left, up = 1.0 - right, 1.0 - down
        shares = -contrast * np.stack([left * up, right * up, right * down, left * down])
        rows = [*shares * across, *shares * along, drawn, np.ones_like(drawn), contrast * curved]
        jacobian = np.array(rows)
        normal = jacobian @ jacobian.T
        solved = np.linalg.solve(normal, jacobian @ pixels)
        residual = pixels - solved @ jacobian
        variance = residual @ residual / max(len(pixels) - len(rows), 1)
        variances = variance * np.linalg.inv(normal).diagonal()[: 2 * CORNERS]
        self.variances_px2 = variances.reshape(2, CORNERS).mean(axis=0)
        self.contrast_dn = float(solved[2 * CORNERS])
        self._blur_px2 = min(max(self._blur_px2 + 1.4 * solved[-1], _BLURS_PX2[0]), _BLURS_PX2[1])
        moved = solved[: 2 * CORNERS].reshape(2, CORNERS).T
        steps_px: FloatArray = np.clip(moved, -_LARGEST_STEP_PX, _LARGEST_STEP_PX)
        return corners_px + steps_px
