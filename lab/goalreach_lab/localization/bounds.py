"""The Cramer-Rao bound: the least error any unbiased estimator can have from one image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.head_tracker import HeadConfig, HeadTracker
from goalreach_perception.measurement_model import Lens, Projection, project

_LEAST_LEDS = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Bound:
    """The best that one image can do at one place, whatever the heading of the robot.

    Attributes:
        x_m: The place.
        y_m: The place.
        leds: How many LEDs the head can hold in the image there.
        covariance: (3, 3) of x, y, heading; infinite where fewer than two LEDs are in the image.
    """

    x_m: float
    y_m: float
    leds: int
    covariance: FloatArray

    @property
    def position_sigma_m(self) -> float:
        """Root of the sum of the variances of x and y, metres."""
        return math.sqrt(self.covariance[0, 0] + self.covariance[1, 1])

    @property
    def heading_sigma_rad(self) -> float:
        """Standard deviation of the heading, radians."""
        return math.sqrt(self.covariance[2, 2])


def one_image_bound(
    x_m: float,
    y_m: float,
    *,
    leds_m: FloatArray,
    camera: PinholeCamera,
    camera_height_m: float,
    pixel_sigma_px: float,
    pan_sigma_rad: float = 0.0,
    tilt_sigma_rad: float = 0.0,
    head: HeadConfig | None = None,
) -> Bound:
    """Return the bound for a head that looks at the LEDs as the head tracker would.

    The information of the pixels about x, y and azimuth is J' C^-1 J with C the covariance of
    the pixels, in which the tilt's error is common to all; that of pan adds to the heading.

    Args:
        x_m: Place of the camera in `map`.
        y_m: Place of the camera in `map`.
        leds_m: (n, 3) LEDs in `map`, known exactly.
        camera: The camera; its distortion is left out.
        camera_height_m: Height of the optical centre.
        pixel_sigma_px: Error of each LED's pixel per axis (1 sigma).
        pan_sigma_rad: Error of the pan reading (1 sigma).
        tilt_sigma_rad: Error of the tilt reading (1 sigma).
        head: Ranges of the head and the margin within which an LED counts as in the image.
    """
    head = head or HeadConfig()
    lens = Lens.of_camera(camera)
    offsets_m = leds_m - np.array([x_m, y_m, camera_height_m])
    azimuth, tilt = HeadTracker(head).aim_at(offsets_m.tolist(), lens)
    projection = project(offsets_m, optical_rotation(azimuth, tilt), lens)
    seen = _in_image(projection, camera)
    covariance = np.full((3, 3), np.inf)
    if seen.sum() >= _LEAST_LEDS:
        by_offset = projection.by_offset[seen]
        turned = np.stack([offsets_m[seen, 1], -offsets_m[seen, 0]], axis=1)
        by_azimuth = np.einsum('kpc,kc->kp', by_offset[..., :2], turned)
        jacobian = np.concatenate([-by_offset[..., :2], by_azimuth[..., None]], axis=2)
        jacobian = jacobian.reshape(-1, 3)
        by_tilt = projection.by_tilt[seen].reshape(-1)
        noise = pixel_sigma_px**2 * np.eye(len(by_tilt))
        noise += tilt_sigma_rad**2 * np.outer(by_tilt, by_tilt)
        covariance = np.linalg.inv(jacobian.T @ np.linalg.solve(noise, jacobian))
        covariance[2, 2] += pan_sigma_rad**2
    return Bound(x_m=x_m, y_m=y_m, leds=int(seen.sum()), covariance=covariance)


def _in_image(projection: Projection, camera: PinholeCamera) -> NDArray[np.bool_]:
    """Return which LEDs are in the image."""
    u, v = projection.pixels_px.T
    seen: NDArray[np.bool_] = (
        (u > 0) & (v > 0) & (u < camera.width_px - 1) & (v < camera.height_px - 1)
    )
    return seen & (projection.depth_m > 0.06)  # noqa: PLR2004 - just above the model's floor


def bound_map(
    xs_m: Sequence[float],
    ys_m: Sequence[float],
    *,
    leds_m: FloatArray,
    camera: PinholeCamera,
    camera_height_m: float,
    pixel_sigma_px: float,
    pan_sigma_rad: float = 0.0,
    tilt_sigma_rad: float = 0.0,
) -> list[list[Bound]]:
    """Return the bound over a grid of the arena: rows of equal y, in the order given.

    Args:
        xs_m: Places along x.
        ys_m: Places along y.
        leds_m: (n, 3) LEDs in `map`.
        camera: The camera.
        camera_height_m: Height of the optical centre.
        pixel_sigma_px: Error of each LED's pixel per axis (1 sigma).
        pan_sigma_rad: Error of the pan reading (1 sigma).
        tilt_sigma_rad: Error of the tilt reading (1 sigma).
    """
    return [
        [
            one_image_bound(
                x_m,
                y_m,
                leds_m=leds_m,
                camera=camera,
                camera_height_m=camera_height_m,
                pixel_sigma_px=pixel_sigma_px,
                pan_sigma_rad=pan_sigma_rad,
                tilt_sigma_rad=tilt_sigma_rad,
            )
            for x_m in xs_m
        ]
        for y_m in ys_m
    ]
