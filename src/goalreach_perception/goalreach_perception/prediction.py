"""What the filter expects of an image, and how far the image is from it."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.values import FloatArray, Pose2
from goalreach_perception.measurement_model import DRIFT, HEADING, HEIGHT, SCALE

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


class OdometryMotion:
    """Moves the pose by what the encoders counted, corrected by their believed errors.

    A turn of all that is known, or a change of its size, about the origin shifts a position by
    what it is away from there. For it to remain such a change, the derivatives by heading and
    scale look at the way between positions as they were predicted, corrections included.

    Args:
        size: Length of the state vector.
    """

    def __init__(self, size: int) -> None:
        self._transition = np.eye(size)
        self._predicted_m = (0.0, 0.0)

    def begin_at(self, x_m: float, y_m: float) -> None:
        """Take a position as predicted."""
        self._predicted_m = (x_m, y_m)

    def move(self, mean: FloatArray, before: Pose2, after: Pose2) -> float:
        """Move the mean in its place.

        Args:
            mean: The state vector.
            before: Odometry pose at the last image.
            after: Odometry pose now, in the same frame.

        Returns:
            The distance that odometry counted, metres.
        """
        dx, dy = after.x_m - before.x_m, after.y_m - before.y_m
        turn = angle_difference(after.heading_rad, before.heading_rad)
        distance = math.hypot(dx, dy)
        x_m, y_m, heading, _, _, scale, drift = mean[:HEIGHT].tolist()
        between = heading - before.heading_rad + 0.5 * drift * distance
        cosine, sine = math.cos(between), math.sin(between)
        east, north = cosine * dx - sine * dy, sine * dx + cosine * dy
        x_m, y_m = x_m + (1.0 + scale) * east, y_m + (1.0 + scale) * north
        mean[:3] = x_m, y_m, wrap_angle(heading + turn + drift * distance)
        matrix = self._transition
        matrix[0, DRIFT], matrix[1, DRIFT] = -0.5 * distance * north, 0.5 * distance * east
        matrix[2, DRIFT] = distance
        east, north = x_m - self._predicted_m[0], y_m - self._predicted_m[1]
        matrix[0, HEADING], matrix[1, HEADING] = -north, east
        matrix[0, SCALE], matrix[1, SCALE] = east, north
        self._predicted_m = (x_m, y_m)
        return distance

    def carry(self, covariance: FloatArray) -> FloatArray:
        """Return a covariance after the last move: only the pose has moved."""
        pose = self._transition[:3]
        moved = pose.dot(covariance)
        carried = covariance.copy()
        carried[:3] = moved
        carried[:, :3] = moved.T
        carried[:3, :3] = moved.dot(pose.T)
        return carried
