"""What the filter expects of an image, and how far the image is from it."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray

__all__ = ['Prediction', 'add_to_diagonal', 'innovate', 'innovation_distance2', 'left_out_px2']

_AXES = np.array([0, 1])


class Prediction(NamedTuple):
    """Where the LEDs should be in an image, and how sure that is.

    Attributes:
        pixels_px: (n, 2) ideal pixels.
        depth_m: n distances along the optical axis, at least 0.05.
        jacobian: (2 n, states) derivative by the state.
        cross: (states, 2 n) covariance of state and pixels.
        encoder_noise: (2 n, 2 n) covariance that the encoders' noise gives the pixels.
        covariance: (2 n, 2 n) covariance of the pixels, encoder noise included, spots' own not.
    """

    pixels_px: FloatArray
    depth_m: list[float]
    jacobian: FloatArray
    cross: FloatArray
    encoder_noise: FloatArray
    covariance: FloatArray

    def of_leds(self, leds: NDArray[np.intp]) -> Prediction:
        """Return the same for some of the LEDs, in the order given."""
        if len(leds) == len(self.depth_m) and leds.tolist() == [*range(len(leds))]:
            return self
        rows = (2 * leds[:, None] + _AXES).reshape(-1)
        square = (rows[:, None], rows)
        return Prediction(
            self.pixels_px[leds],
            [self.depth_m[led] for led in leds.tolist()],
            self.jacobian[rows],
            self.cross[:, rows],
            self.encoder_noise[square],
            self.covariance[square],
        )


def add_to_diagonal(matrix: FloatArray, values: FloatArray | float) -> None:
    """Add to the diagonal of a square, contiguous matrix in its place."""
    matrix.reshape(-1)[:: len(matrix) + 1] += values


def left_out_px2(
    depth_m: list[float],
    focal_px: float,
    spread_m2: tuple[float, float],
    *,
    encoder_sigma_rad: float,
) -> FloatArray:
    """Return what the derivatives leave out of the pixels, as variances, (2 n,).

    With an uncertainty s of the optical centre and an LED at depth Z, a pixel is bent by the
    order of f s^2 / (2 Z^2), and what the encoders' noise e moves it by is off by e f s / Z.
    Both count as noise (a second-order filter in its simplest form), or an uncertain pose
    would soon be overconfident.

    Args:
        depth_m: n distances of LEDs along the optical axis.
        focal_px: Focal length.
        spread_m2: Variance of the optical centre, on the floor (x and y together) and in height.
        encoder_sigma_rad: Noise of the head's encoders (1 sigma).
    """
    floor_m2, height_m2 = spread_m2
    bent, turned = 0.5 * focal_px * floor_m2, (encoder_sigma_rad * focal_px) ** 2
    turned *= floor_m2 + height_m2
    left_out = [(bent / z2) ** 2 + turned / z2 for z2 in (depth * depth for depth in depth_m)]
    return np.array(left_out).repeat(2)


def innovate(
    part: Prediction, pixels_px: FloatArray, sigmas_px: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return the innovation, the variances of the spots, its inverse covariance and length.

    The length, squared, is infinite where the covariance has no inverse.
    """
    innovation = (pixels_px - part.pixels_px).reshape(-1)
    spots = (sigmas_px * sigmas_px).repeat(2)
    covariance = part.covariance.copy()
    add_to_diagonal(covariance, spots)
    regular, inverted = cv2.invert(covariance, flags=cv2.DECOMP_CHOLESKY)
    inverse = np.asarray(inverted, dtype=np.float64)
    distance2 = float(innovation.dot(inverse.dot(innovation))) if regular else math.inf
    return innovation, spots, inverse, distance2


def innovation_distance2(
    prediction: Prediction, leds: NDArray[np.intp], pixels_px: FloatArray, sigmas_px: FloatArray
) -> float:
    """Return the squared distance of LEDs from their prediction, 2 k degrees of freedom."""
    return innovate(prediction.of_leds(leds), pixels_px, sigmas_px)[3]
