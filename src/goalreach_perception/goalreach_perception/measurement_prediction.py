"""Predicted pixels of the LEDs of one image, their covariance, and the innovation.

`measurement_model` serves thousands of cameras at once. For one camera and three LEDs most of its
time is spent on small arrays; the plain numbers here take a third of it. A test compares the two.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_model import MINIMUM_DEPTH_M

_AXES = np.array([0, 1])


def offsets_from(
    places_m: Sequence[float], x_m: float, y_m: float, z_m: float
) -> list[tuple[float, float, float]]:
    """Return points, given as x, y, z, x, ..., relative to another point."""
    xyz = zip(places_m[::3], places_m[1::3], places_m[2::3], strict=True)
    return [(x - x_m, y - y_m, z - z_m) for x, y, z in xyz]


class PredictedLeds(NamedTuple):
    """Predicted pixels of n LEDs with their derivatives.

    Attributes:
        pixels_px: (n, 2) pixels.
        depth_m: n distances along the optical axis, at least 0.05.
        by_state: (2 n, 9 + 3 n) derivative by the state, rows u_0, v_0, u_1, v_1, ...
        by_head: (2 n, 2) derivative by pan and tilt at the best estimates.
    """

    pixels_px: FloatArray
    depth_m: list[float]
    by_state: FloatArray
    by_head: FloatArray


def predict_leds(
    offsets_m: Sequence[Sequence[float]],
    first_m: Sequence[Sequence[float]],
    axis_rad: tuple[float, float],
    intrinsics_px: tuple[float, float, float, float],
) -> PredictedLeds:
    """Project LEDs and differentiate by the whole state vector.

    As `measurement_model.project` and `state_jacobian`, except (see `PoseFilter`) that heading
    and pan bias have the columns of an LED at `first_m`, and the odometry scale that of the part
    of `first_m` across the ray.

    Args:
        offsets_m: n LEDs minus the optical centre in `map`, metres.
        first_m: The same by the first estimates.
        axis_rad: Azimuth of the optical axis in `map`, and its tilt, upward.
        intrinsics_px: Estimated focal lengths and principal point: fx, fy, cx, cy.
    """
    (ca, ct), (sa, st) = map(math.cos, axis_rad), map(math.sin, axis_rad)
    fx, fy, cx, cy = intrinsics_px
    pixels, rows, by_head, depths = array('d'), array('d'), array('d'), list[float]()
    zeros = (0.0,) * (3 * len(offsets_m))
    for led, ((dx, dy, dz), first) in enumerate(zip(offsets_m, first_m, strict=True)):
        around = zeros[: 3 * led], zeros[3 * led + 3 :]
        forward = ca * dx + sa * dy
        depth = max(ct * forward + st * dz, MINIMUM_DEPTH_M)
        su, sv = (sa * dx - ca * dy) / depth, (st * forward - ct * dz) / depth
        ku, kv, rise = fx / depth, fy / depth, st - sv * ct
        ux, uy, uz = ku * (sa - su * ca * ct), -ku * (ca + su * sa * ct), -ku * su * st
        vx, vy, vz = kv * ca * rise, kv * sa * rise, -kv * (ct + sv * st)
        ray_u, ray_v = fx * su, fy * sv
        tilt_u, tilt_v = ray_u * sv, ray_v * sv + fy
        rows.extend(_state_row((ux, uy, uz), first, tilt_u, ray_u, around))
        rows.extend(_state_row((vx, vy, vz), first, tilt_v, ray_v, around))
        by_head.extend((ux * dy - uy * dx, tilt_u, vx * dy - vy * dx, tilt_v))
        pixels.extend((cx + ray_u, cy + ray_v))
        depths.append(depth)
    by_state = np.frombuffer(rows).reshape(2 * len(depths), -1)
    return PredictedLeds(_pairs(pixels), depths, by_state, _pairs(by_head))


def _state_row(
    by_led: tuple[float, float, float],
    first_m: Sequence[float],
    by_tilt: float,
    by_focal: float,
    around: tuple[tuple[float, ...], tuple[float, ...]],
) -> tuple[float, ...]:
    """Return the derivative of u or v by the state, given that by the LED.

    `around` holds the zeros of the LEDs before this one and after it.
    """
    (x, y, z), (tx, ty, tz), (before, after) = by_led, first_m, around
    turn, scale = x * ty - y * tx, -(x * tx + y * ty + z * tz)
    return (-x, -y, turn, turn, by_tilt, scale, 0.0, -z, by_focal, *before, x, y, z, *after)


def _pairs(numbers: array[float]) -> FloatArray:
    return np.frombuffer(numbers).reshape(-1, 2)


class Prediction(NamedTuple):
    """Predicted pixels of n LEDs and their covariances.

    Attributes:
        pixels_px: (n, 2) ideal pixels.
        depth_m: n distances along the optical axis, at least 0.05.
        jacobian: (2 n, states) derivative by the state.
        cross: (states, 2 n) covariance of state and pixels.
        encoder_noise: (2 n, 2 n) covariance of the pixels due to encoder noise.
        covariance: (2 n, 2 n) covariance of the pixels, encoder noise included, that of the
            centroids not.
    """

    pixels_px: FloatArray
    depth_m: list[float]
    jacobian: FloatArray
    cross: FloatArray
    encoder_noise: FloatArray
    covariance: FloatArray

    def select(self, leds: NDArray[np.intp]) -> Prediction:
        """Return the prediction of some of the LEDs, in the order given."""
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
    """Add to the diagonal of a square, contiguous matrix in place."""
    matrix.reshape(-1)[:: len(matrix) + 1] += values


def second_order_variances_px2(
    depth_m: list[float],
    focal_px: float,
    spread_m2: tuple[float, float],
    *,
    encoder_sigma_rad: float,
) -> FloatArray:
    """Return the variances of the pixels that linearization neglects, (2 n,).

    With a standard deviation s of the optical centre and an LED at depth Z, the second-order term
    of a pixel is of the order of f s^2 / (2 Z^2), and the effect of the encoder noise e is wrong
    by e f s / Z. Both are added as noise (a second-order filter in its simplest form); without
    them an uncertain pose would soon be overconfident.

    Args:
        depth_m: n distances of LEDs along the optical axis.
        focal_px: Focal length.
        spread_m2: Variance of the optical centre, on the floor (x and y together) and in height.
        encoder_sigma_rad: Noise of the head's encoders (1 sigma).
    """
    floor_m2, height_m2 = spread_m2
    bent, turned = 0.5 * focal_px * floor_m2, (encoder_sigma_rad * focal_px) ** 2
    turned *= floor_m2 + height_m2
    variances = [(bent / z2) ** 2 + turned / z2 for z2 in (depth * depth for depth in depth_m)]
    return np.array(variances).repeat(2)


def compute_innovation(
    prediction: Prediction, pixels_px: FloatArray, sigmas_px: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Compare measured pixels with their prediction.

    Args:
        prediction: Of the LEDs measured.
        pixels_px: (k, 2) measured ideal pixels.
        sigmas_px: (k,) standard deviation per axis.

    Returns:
        The innovation (2 k,), the variances of the centroids (2 k,), the inverse covariance of
        the innovation and its squared Mahalanobis distance, infinite if there is no inverse.
    """
    innovation = (pixels_px - prediction.pixels_px).reshape(-1)
    centroids = (sigmas_px * sigmas_px).repeat(2)
    covariance = prediction.covariance.copy()
    add_to_diagonal(covariance, centroids)
    regular, inverted = cv2.invert(covariance, flags=cv2.DECOMP_CHOLESKY)
    inverse = np.asarray(inverted, dtype=np.float64)
    distance2 = float(innovation.dot(inverse.dot(innovation))) if regular else math.inf
    return innovation, centroids, inverse, distance2


def innovation_distance2(
    prediction: Prediction, leds: NDArray[np.intp], pixels_px: FloatArray, sigmas_px: FloatArray
) -> float:
    """Return the squared Mahalanobis distance of LEDs, 2 k degrees of freedom."""
    return compute_innovation(prediction.select(leds), pixels_px, sigmas_px)[3]
