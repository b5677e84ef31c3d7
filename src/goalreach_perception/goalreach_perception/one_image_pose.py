"""Poses from one image: closed-form initial guesses and maximum likelihood by Gauss-Newton.

Many labellings are solved at once. Unknown are x, y and the azimuth of the optical axis. All other
uncertain quantities (tilt, level, camera height, focal length, LEDs) enter the weights of the
pixels, so the chi-square of a solution has 2 k - 3 degrees of freedom and its covariance is
consistent. The closed forms work in the plane, with complex numbers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_model import (
    BEHIND_M,
    TILT_BIAS,
    Lens,
    Projection,
    offset_derivatives,
    project,
    state_jacobian,
)

_ITERATIONS = 5
_FEWEST_ITERATIONS = 2
_CONVERGED = 1e-4
"""Largest step of a converged solution, metres and radians: the next step is of the order of its
square. Chosen."""
_DAMPING = 1e-6
_LARGEST_STEP = np.array([0.7, 0.7, 0.35])
"""Metres, metres, radians per iteration. Chosen: keeps a step within the linear range."""
_POSE = [0, 1, 2]
_TINY = 1e-12


ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True)
class ImageGeometry:
    """Everything known when an image is solved.

    Attributes:
        leds_m: (n, 3) estimated positions of the LEDs in `map`; corners of tags follow.
        led_count: How many of them spots may be.
        mount_m: Place of the optical centre in the head: forward and left of the axis.
        turns_rad: (spots,) azimuth of the optical axis relative to the unknown azimuth: zero for
            spots of one image.
        tilts_rad: (spots,) tilt encoder reading plus estimated bias.
        level_rad: Rotation of the base about x and y of `map`.
        nuisance_covariance: (14 + 3 n, 14 + 3 n) covariance of the state vector without the
            delay, of which the rows from the tilt bias on are used.
        tilt_noise_rad: Noise of the tilt encoder (1 sigma).
    """

    leds_m: FloatArray
    led_count: int
    camera_height_m: float
    mount_m: tuple[float, float] = (0.0, 0.0)
    level_rad: Sequence[float] = (0.0, 0.0)
    turns_rad: FloatArray
    tilts_rad: FloatArray
    lens: Lens
    nuisance_covariance: FloatArray
    tilt_noise_rad: float

    def project(
        self, poses: FloatArray, leds: NDArray[np.intp], spots: NDArray[np.intp]
    ) -> tuple[FloatArray, Projection]:
        """Project LEDs from poses, each with the camera direction of its spot.

        Poses are (m, 3), the indices of LEDs and spots (m, k). Returns LEDs minus the axis at the
        height of the lens, (m, k, 3), and their projection.
        """
        offsets_m = self.leds_m[leds]
        offsets_m[..., :2] -= poses[:, None, :2]
        offsets_m[..., 2] -= self.camera_height_m
        azimuths, tilts = poses[:, 2:] + self.turns_rad[spots], self.tilts_rad[spots]
        rotations = _rotations(azimuths, tilts)
        wx, wy = self.level_rad
        seen_m = offsets_m @ np.array([[1.0, 0.0, wy], [0.0, 1.0, -wx], [-wy, wx, 1.0]])
        if any(self.mount_m):
            forward, left = self.mount_m
            seen_m -= forward * rotations[..., 2, :] - left * rotations[..., 0, :]
        single = project(seen_m[:, :, None, :], rotations, self.lens)
        single.by_tilt[..., 1] += self.mount_m[0] * self.lens.focal_px[1] / single.depth_m
        return offsets_m, Projection(*(array[:, :, 0] for array in single))


@dataclass(frozen=True)
class Solutions:
    """Poses of m labellings.

    Attributes:
        poses: (m, 3) of x (m), y (m), azimuth of the optical axis (rad, not wrapped).
        chi2: (m,) of the residuals, 2 k - 3 degrees of freedom; infinite where an LED would be
            behind the camera.
        information: (m, 3, 3) inverse covariance of each pose.
    """

    poses: FloatArray
    chi2: FloatArray
    information: FloatArray


def _rotations(azimuths: FloatArray, tilts: FloatArray) -> FloatArray:
    """Return the rotations from `map` to the optical frame, (m, k, 3, 3)."""
    ca, sa = np.cos(azimuths), np.sin(azimuths)
    ct, st = np.cos(tilts), np.sin(tilts)
    rotations = np.zeros((*azimuths.shape, 3, 3))
    rotations[..., 0, 0], rotations[..., 0, 1] = sa, -ca
    rotations[..., 1, 0], rotations[..., 1, 1], rotations[..., 1, 2] = ca * st, sa * st, -ct
    rotations[..., 2, 0], rotations[..., 2, 1], rotations[..., 2, 2] = ca * ct, sa * ct, st
    return rotations


def _weights(
    geometry: ImageGeometry,
    projection: Projection,
    offsets_m: FloatArray,
    derivatives: FloatArray,
    variances_px2: FloatArray,
) -> FloatArray:
    """Return the inverse covariance of the pixels, (m, 2 k, 2 k)."""
    jacobian = state_jacobian(projection, offsets_m, derivatives)[..., TILT_BIAS:]
    nuisance = geometry.nuisance_covariance[TILT_BIAS:, TILT_BIAS:].copy()
    nuisance[0, 0] += geometry.tilt_noise_rad**2
    covariance = jacobian @ nuisance @ jacobian.swapaxes(-1, -2)
    diagonal = np.arange(covariance.shape[-1])
    covariance[:, diagonal, diagonal] += variances_px2
    return np.asarray(np.linalg.inv(covariance), dtype=np.float64)


def solve_poses(
    geometry: ImageGeometry,
    pixels_px: FloatArray,
    sigmas_px: FloatArray,
    *,
    spots: NDArray[np.intp],
    leds: NDArray[np.intp],
    seeds: FloatArray,
    iterations: int = _ITERATIONS,
) -> Solutions:
    """Return the most likely pose of each labelling.

    Args:
        geometry: Everything known.
        pixels_px: (n, 2) ideal pixels of the spots.
        sigmas_px: (n,) standard deviation of each per axis.
        spots: (m, k) spots of each labelling.
        leds: (m, k) LED of each spot.
        seeds: (m, 3) initial guesses of x, y, azimuth.
        iterations: Largest number of Gauss-Newton steps; fewer if all have converged.
    """
    poses, measured_px = seeds.copy(), pixels_px[spots]
    derivatives = offset_derivatives(len(geometry.leds_m))[leds]
    variances = np.repeat(sigmas_px[spots] ** 2, 2, axis=1)
    offsets_m, projection = geometry.project(poses, leds, spots)
    weights = _weights(geometry, projection, offsets_m, derivatives, variances)
    for iteration in range(1, iterations + 1):
        steps = _step(projection, offsets_m, measured_px, weights)
        poses += np.clip(steps, -_LARGEST_STEP, _LARGEST_STEP)
        offsets_m, projection = geometry.project(poses, leds, spots)
        if iteration >= _FEWEST_ITERATIONS and np.abs(steps).max() < _CONVERGED:
            break
    weights = _weights(geometry, projection, offsets_m, derivatives, variances)
    jacobian = _pose_jacobian(projection, offsets_m)
    residuals = (measured_px - projection.pixels_px).reshape(len(poses), -1, 1)
    chi2 = (residuals.swapaxes(1, 2) @ weights @ residuals)[:, 0, 0]
    chi2[(projection.depth_m <= BEHIND_M).any(axis=1) | ~np.isfinite(chi2)] = np.inf
    return Solutions(poses, chi2, jacobian.swapaxes(1, 2) @ weights @ jacobian)


def _step(
    projection: Projection, offsets_m: FloatArray, measured_px: FloatArray, weights: FloatArray
) -> FloatArray:
    """Return the damped Gauss-Newton step of each pose, (m, 3)."""
    residuals = (measured_px - projection.pixels_px).reshape(len(measured_px), -1, 1)
    jacobian = _pose_jacobian(projection, offsets_m)
    weighted = jacobian.swapaxes(1, 2) @ weights
    normal = weighted @ jacobian
    normal[:, _POSE, _POSE] *= 1.0 + _DAMPING
    normal[:, _POSE, _POSE] += _DAMPING
    return np.asarray(np.linalg.solve(normal, weighted @ residuals)[..., 0], dtype=np.float64)


def _pose_jacobian(projection: Projection, offsets_m: FloatArray) -> FloatArray:
    """Return the derivative of the pixels by x, y, azimuth: (m, 2 k, 3)."""
    by_offset = projection.by_offset
    jacobian = np.empty_like(by_offset)
    jacobian[..., :2] = -by_offset[..., :2]
    jacobian[..., 2] = by_offset[..., 0] * offsets_m[..., 1:2]
    jacobian[..., 2] -= by_offset[..., 1] * offsets_m[..., :1]
    return jacobian.reshape(len(by_offset), -1, 3)


def level_points(slopes: FloatArray, rise_m: FloatArray, tilt_rad: FloatArray) -> ComplexArray:
    """Return the positions of LEDs of known height in the levelled frame of the camera.

    A ray (s_u, s_v, 1) of a camera tilted by T runs cos T + sin T s_v forward, s_u to the right
    and sin T - cos T s_v up; it is extended to the height of the LED.

    Args:
        slopes: (..., 2) of (pixel - centre) / focal length.
        rise_m: (...) height of the LED above the optical centre, metres.
        tilt_rad: (...) tilt, upward.

    Returns:
        (...) forward + left * 1j, metres; NaN where the ray never reaches that height.
    """
    forward = np.cos(tilt_rad) + np.sin(tilt_rad) * slopes[..., 1]
    up = np.sin(tilt_rad) - np.cos(tilt_rad) * slopes[..., 1]
    with np.errstate(divide='ignore', invalid='ignore'):
        stretch = rise_m / up
    stretch = np.where(stretch > 0.0, stretch, np.nan)
    return np.asarray(stretch * (forward - 1j * slopes[..., 0]), dtype=np.complex128)


def align(places_m: ComplexArray, seen_m: ComplexArray) -> FloatArray:
    """Return the pose that aligns measured LEDs with the map: least squares, closed form.

    Args:
        places_m: (m, k) LEDs in `map`, x + y * 1j.
        seen_m: (m, k) the same in the levelled camera frame, forward + left * 1j; k >= 2.

    Returns:
        (m, 3) of x, y, azimuth.
    """
    middle_m, seen_middle_m = places_m.mean(axis=1), seen_m.mean(axis=1)
    turn: ComplexArray = (
        (places_m - middle_m[:, None]) * np.conj(seen_m - seen_middle_m[:, None])
    ).sum(axis=1)
    with np.errstate(invalid='ignore'):
        turn /= np.maximum(np.abs(turn), _TINY)
    position_m = middle_m - turn * seen_middle_m
    return np.stack([position_m.real, position_m.imag, np.angle(turn)], axis=1)


def triangulate(places_m: ComplexArray, rays: ComplexArray) -> FloatArray:
    """Return the pose from the bearings of three LEDs alone, without their heights.

    Three-object triangulation by intersecting circles, as in Pierlot and Van Droogenbroeck,
    "A New Three Object Triangulation Algorithm for Mobile Robot Positioning" (IEEE T-RO 2014),
    derived here in complex numbers: with the second LED as origin, the positions R that see LEDs
    1 and 2 under the directed angle a are the circle sin(a) |R|^2 = Re(conj(R) (-i) B1 exp(i a)),
    and those that see 2 and 3 under b are sin(b) |R|^2 = Re(conj(R) i B3 exp(-i b)). Both circles
    pass through the origin; the line through their other intersection is perpendicular to
    n = sin(b) (-i) B1 exp(i a) - sin(a) i B3 exp(-i b). If the two circles coincide
    (the danger circle), n is zero and the pose arbitrary.

    Args:
        places_m: (m, 3) LEDs in `map`, x + y * 1j.
        rays: (m, 3) unit directions in the levelled camera frame, forward + left * 1j.

    Returns:
        (m, 3) of x, y, azimuth.
    """
    origin_m = places_m[:, 1]
    first_m, third_m = places_m[:, 0] - origin_m, places_m[:, 2] - origin_m
    turn_12 = rays[:, 1] * np.conj(rays[:, 0])
    turn_23 = rays[:, 2] * np.conj(rays[:, 1])
    circle_12 = -1j * first_m * turn_12
    circle_23 = 1j * third_m * np.conj(turn_23)
    normal = turn_23.imag * circle_12 - turn_12.imag * circle_23
    across = 1j * normal
    length2 = np.maximum(np.abs(normal) ** 2, _TINY**2)
    use_first = np.abs(turn_12.imag) >= np.abs(turn_23.imag)
    circle = np.where(use_first, circle_12, circle_23)
    sine = np.where(use_first, turn_12.imag, turn_23.imag)
    sine = np.where(np.abs(sine) < _TINY, _TINY, sine)
    offset_m = across * (np.conj(across) * circle).real / (sine * length2)
    azimuth = np.angle(-(offset_m * np.conj(rays[:, 1])))
    position_m = origin_m + offset_m
    return np.stack([position_m.real, position_m.imag, azimuth], axis=1)
