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

_AXES = 0, 1


def offsets_from(
    places_m: Sequence[float],
    x_m: float,
    y_m: float,
    z_m: float,
    level_rad: Sequence[float] = (0.0, 0.0),
) -> list[tuple[float, float, float]]:
    """Return points, given as x, y, z, x, ..., relative to a lens, as seen from a level base.

    The level is a small rotation about x and y; it moves the lens by less than `mount_sigma_m`.
    """
    wx, wy = level_rad
    xyz = zip(places_m[::3], places_m[1::3], places_m[2::3], strict=True)
    offsets_m = ((x - x_m, y - y_m, z - z_m) for x, y, z in xyz)
    return [(x - wy * z, y + wx * z, z + wy * x - wx * y) for x, y, z in offsets_m]


class PredictedLeds(NamedTuple):
    """Predicted pixels of n LEDs with their derivatives.

    Attributes:
        pixels_px: (n, 2) pixels.
        depth_m: n distances along the optical axis, at least 0.05.
        by_state: (2 n, 14 + 3 n) derivative by the state, rows u_0, v_0, u_1, v_1, ...
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
    mount_m: tuple[float, float] = (0.0, 0.0),
) -> PredictedLeds:
    """Project LEDs and differentiate by the whole state vector.

    As `measurement_model.project` and `state_jacobian`, except (see `PoseFilter`) that heading,
    pan bias and level have the columns of an LED at `first_m`, and the odometry scale that of the
    part of `first_m` across the ray.

    Args:
        offsets_m: n LEDs from the point of the axis at the height of the lens, metres, as seen
            from a base that is level in `map`.
        first_m: The same by the first estimates.
        axis_rad: Azimuth of the optical axis in `map`, and its tilt, upward.
        intrinsics_px: Estimated focal lengths and principal point: fx, fy, cx, cy.
        mount_m: Optical centre in the head: forward and left of the axis.
    """
    (ca, ct), (sa, st) = map(math.cos, axis_rad), map(math.sin, axis_rad)
    (fx, fy, cx, cy), (mount_x, mount_y) = intrinsics_px, mount_m
    depths: list[float] = []
    parts: list[tuple[float, ...]] = []
    pixels, by_head = array('d'), array('d')
    for dx, dy, dz in offsets_m:
        forward = ca * dx + sa * dy
        depths.append(depth := max(ct * forward + st * dz - mount_x, MINIMUM_DEPTH_M))
        su, sv = (sa * dx - ca * dy + mount_y) / depth, (st * forward - ct * dz) / depth
        ku, kv, rise = fx / depth, fy / depth, st - sv * ct
        ux, uy, uz = ku * (sa - su * ca * ct), -ku * (ca + su * sa * ct), -ku * su * st
        vx, vy, vz = kv * ca * rise, kv * sa * rise, -kv * (ct + sv * st)
        ray_u, ray_v = fx * su, fy * sv
        tilt_u, tilt_v = ray_u * sv, ray_v * sv + fy + kv * mount_x
        parts.append((ux, uy, uz, tilt_u, ray_u, ku * su, ku))
        parts.append((vx, vy, vz, tilt_v, ray_v, kv * sv, 0.0))
        by_head.extend((ux * dy - uy * dx, tilt_u, vx * dy - vy * dx, tilt_v))
        pixels.extend((cx + ray_u, cy + ray_v))
    return PredictedLeds(_pairs(pixels), depths, _by_state(parts, first_m), _pairs(by_head))


def _by_state(
    parts: Sequence[tuple[float, ...]], first_m: Sequence[Sequence[float]]
) -> FloatArray:
    """Return the derivatives by the state, given those by x, y, z of the LED and by constants.

    Args:
        parts: 2 n derivatives, u and v of each LED, by x, y, z, tilt, focal, forward, left.
        first_m: n LEDs from the camera by the first estimates.
    """
    size = 3 * len(first_m) + 14
    rows = [0.0] * (len(parts) * size)
    for index, (x, y, z, tilt, focal, forward, left) in enumerate(parts):
        at, led = index * size, index // 2
        tx, ty, tz = first_m[led]
        turn, scale = x * ty - y * tx, -(x * tx + y * ty + z * tz)
        rows[at : at + 9] = -x, -y, turn, turn, tilt, scale, 0.0, -z, focal
        rows[at + 3 * led + 9 : at + 3 * led + 12] = x, y, z
        rows[at + size - 5 : at + size] = forward, left, 0.0, y * tz - z * ty, z * tx - x * tz
    return np.frombuffer(array('d', rows)).reshape(-1, size)


def _pairs(numbers: array[float]) -> FloatArray:
    return np.frombuffer(numbers).reshape(-1, 2)


class Prediction(NamedTuple):
    """Predicted pixels of n LEDs and their covariances.

    Attributes:
        pixels_px: (n, 2) ideal pixels.
        depth_m: n distances along the optical axis, at least 0.05.
        cross: (states, 2 n) covariance of state and pixels.
        covariance: (2 n, 2 n) covariance of the pixels, encoder noise included, that of the
            centroids not.
    """

    pixels_px: FloatArray
    depth_m: list[float]
    cross: FloatArray
    covariance: FloatArray

    def select(self, leds: NDArray[np.intp]) -> Prediction:
        """Return the prediction of some of the LEDs, in the order given."""
        if len(leds) == len(self.depth_m) and leds.tolist() == [*range(len(leds))]:
            return self
        rows = (2 * leds[:, None] + np.array(_AXES)).reshape(-1)
        return Prediction(
            self.pixels_px[leds],
            [self.depth_m[led] for led in leds.tolist()],
            self.cross[:, rows],
            self.covariance[rows[:, None], rows],
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
    them an uncertain pose would soon be overconfident. `spread_m2` is the variance of the optical
    centre on the floor, x and y together, and in height.
    """
    floor_m2, height_m2 = spread_m2
    bent, turned = 0.5 * focal_px * floor_m2, (encoder_sigma_rad * focal_px) ** 2
    turned *= floor_m2 + height_m2
    squares = [depth * depth for depth in depth_m]
    return np.array([(bent / z2) ** 2 + turned / z2 for z2 in squares]).repeat(2)


def compute_innovation(
    prediction: Prediction, pixels_px: FloatArray, sigmas_px: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Compare measured pixels, with a standard deviation each, with their prediction.

    Returns:
        The innovation (2 k,), its covariance (2 k, 2 k), the inverse of that, and the squared
        Mahalanobis distance, infinite if there is no inverse.
    """
    innovation = (pixels_px - prediction.pixels_px).reshape(-1)
    covariance = prediction.covariance.copy()
    add_to_diagonal(covariance, (sigmas_px * sigmas_px).repeat(2))
    regular, inverted = cv2.invert(covariance, flags=cv2.DECOMP_CHOLESKY)
    inverse = np.asarray(inverted, dtype=np.float64)
    distance2 = float(innovation.dot(inverse.dot(innovation))) if regular else math.inf
    return innovation, covariance, inverse, distance2


def equivalent_gate(gate: float, freedom: int, larger: float) -> float:
    """Return the gate that is exceeded as rarely with more degrees of freedom.

    By the cube root of chi-square, which is nearly normal (Wilson and Hilferty, PNAS 1931).
    """
    if larger <= freedom:
        return gate
    spread, wider = (2.0 / (9.0 * n) for n in (freedom, larger))
    sigmas = ((gate / freedom) ** (1 / 3) - 1.0 + spread) / math.sqrt(spread)
    return float(larger * (1.0 - wider + sigmas * math.sqrt(wider)) ** 3)


def innovation_distance2(
    prediction: Prediction, leds: NDArray[np.intp], pixels_px: FloatArray, sigmas_px: FloatArray
) -> float:
    """Return the squared Mahalanobis distance of LEDs, 2 k degrees of freedom."""
    return compute_innovation(prediction.select(leds), pixels_px, sigmas_px)[3]
