"""Maximum-likelihood poses from one image: Gauss-Newton on pixels, many labellings at once.

Unknown are x, y and the azimuth of the optical axis. Everything else that is not known exactly
(tilt, camera height, focal length, places of the LEDs) enters the weight of the pixels, so the
chi-square of a solution has 2 k - 3 degrees of freedom and its covariance is honest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_model import (
    TILT_BIAS,
    Lens,
    Projection,
    project,
    state_jacobian,
)

__all__ = ['ImageGeometry', 'Solutions', 'solve_poses']

_ITERATIONS = 5
_DAMPING = 1e-6
_LARGEST_STEP = np.array([0.7, 0.7, 0.35])
"""Metres, metres, radians per iteration. Chosen: keeps a step where the model holds."""
_POSE_COLUMNS = [0, 1, 2]


@dataclass(frozen=True, kw_only=True)
class ImageGeometry:
    """What is known when an image is solved.

    Attributes:
        leds_m: (n, 3) believed places of the LEDs in `map`.
        camera_height_m: Believed height of the optical centre.
        tilt_rad: Encoder reading plus believed bias.
        lens: Believed lens.
        nuisance_covariance: (9 + 3 n,) squared covariance of the state vector, of which the rows
            from the tilt bias on are used.
        tilt_noise_rad: Noise of the tilt encoder (1 sigma).
    """

    leds_m: FloatArray
    camera_height_m: float
    tilt_rad: float
    lens: Lens
    nuisance_covariance: FloatArray
    tilt_noise_rad: float

    def project(self, poses: FloatArray, leds: NDArray[np.intp]) -> Projection:
        """Project LEDs as seen from poses.

        Args:
            poses: (m, 3) of x, y, azimuth.
            leds: (m, k) indices of LEDs.
        """
        centres = np.empty((len(poses), 1, 3))
        centres[:, 0, :2] = poses[:, :2]
        centres[:, 0, 2] = self.camera_height_m
        rotations = _rotations(poses[:, 2], self.tilt_rad)
        return project(self.leds_m[leds] - centres, rotations, self.lens)


@dataclass(frozen=True)
class Solutions:
    """Poses of m labellings.

    Attributes:
        poses: (m, 3) of x (m), y (m), azimuth of the optical axis (rad, not wrapped).
        chi2: (m,) of the residuals, 2 k - 3 degrees of freedom; infinite where a LED would be
            behind the camera.
        information: (m, 3, 3) inverse covariance of each pose.
    """

    poses: FloatArray
    chi2: FloatArray
    information: FloatArray


def _rotations(azimuths: FloatArray, tilt_rad: float) -> FloatArray:
    """Return the rotations from `map` to the optical frame, (m, 3, 3)."""
    ca, sa = np.cos(azimuths), np.sin(azimuths)
    ct, st = np.cos(tilt_rad), np.sin(tilt_rad)
    rotations = np.zeros((len(azimuths), 3, 3))
    rotations[:, 0, 0], rotations[:, 0, 1] = sa, -ca
    rotations[:, 1, 0], rotations[:, 1, 1], rotations[:, 1, 2] = ca * st, sa * st, -ct
    rotations[:, 2, 0], rotations[:, 2, 1], rotations[:, 2, 2] = ca * ct, sa * ct, st
    return rotations


def _weights(
    geometry: ImageGeometry,
    projection: Projection,
    leds: NDArray[np.intp],
    sigmas_px: FloatArray,
) -> FloatArray:
    """Return the inverse covariance of the pixels, (m, 2 k, 2 k)."""
    size = len(geometry.nuisance_covariance)
    jacobian = state_jacobian(projection, leds, size)[..., TILT_BIAS:]
    nuisance = geometry.nuisance_covariance[TILT_BIAS:, TILT_BIAS:].copy()
    nuisance[0, 0] += geometry.tilt_noise_rad**2
    covariance = jacobian @ nuisance @ jacobian.swapaxes(-1, -2)
    diagonal = np.arange(covariance.shape[-1])
    covariance[:, diagonal, diagonal] += np.repeat(sigmas_px**2, 2, axis=1)
    return np.linalg.inv(covariance)


def solve_poses(
    geometry: ImageGeometry,
    pixels_px: FloatArray,
    sigmas_px: FloatArray,
    leds: NDArray[np.intp],
    seeds: FloatArray,
    *,
    iterations: int = _ITERATIONS,
) -> Solutions:
    """Return the most likely pose of each labelling.

    Args:
        geometry: What is known.
        pixels_px: (m, k, 2) ideal pixels (lens distortion removed).
        sigmas_px: (m, k) standard deviation of each per axis.
        leds: (m, k) which LED each is.
        seeds: (m, 3) first guesses of x, y, azimuth.
        iterations: Gauss-Newton steps.
    """
    poses = seeds.copy()
    projection = geometry.project(poses, leds)
    weights = _weights(geometry, projection, leds, sigmas_px)
    for _ in range(iterations):
        residuals = (pixels_px - projection.pixels_px).reshape(len(poses), -1, 1)
        jacobian = _pose_jacobian(projection)
        weighted = jacobian.swapaxes(1, 2) @ weights
        normal = weighted @ jacobian
        trace = normal[:, _POSE_COLUMNS, _POSE_COLUMNS]
        normal[:, _POSE_COLUMNS, _POSE_COLUMNS] += _DAMPING * trace + 1e-12
        steps = np.linalg.solve(normal, weighted @ residuals)[..., 0]
        poses += np.clip(steps, -_LARGEST_STEP, _LARGEST_STEP)
        projection = geometry.project(poses, leds)
    weights = _weights(geometry, projection, leds, sigmas_px)
    jacobian = _pose_jacobian(projection)
    residuals = (pixels_px - projection.pixels_px).reshape(len(poses), -1, 1)
    chi2 = (residuals.swapaxes(1, 2) @ weights @ residuals)[:, 0, 0]
    seen = (projection.depth_m > 0.06).all(axis=1)  # noqa: PLR2004 - just above its floor
    information = jacobian.swapaxes(1, 2) @ weights @ jacobian
    return Solutions(poses, np.where(seen & np.isfinite(chi2), chi2, np.inf), information)


def _pose_jacobian(projection: Projection) -> FloatArray:
    """Return the derivative of the pixels by x, y, azimuth: (m, 2 k, 3)."""
    shape = projection.pixels_px.shape
    jacobian = np.empty((*shape, 3))
    jacobian[..., :2] = -projection.by_led[..., :2]
    jacobian[..., 2] = projection.by_azimuth
    return jacobian.reshape(shape[0], 2 * shape[1], 3)
