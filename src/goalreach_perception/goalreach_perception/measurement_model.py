"""The pixel of an LED as a function of everything that is not known for certain.

State vector of the whole package, n LEDs (9 + 3 n numbers, so 18 for three):

| index | state | unit |
| --- | --- | --- |
| 0, 1, 2 | x, y, heading in `map` | m, m, rad |
| 3, 4 | pan bias, tilt bias: true joint angle minus encoder reading | rad |
| 5 | odometry scale: true distance / measured distance - 1 | 1 |
| 6 | odometry drift: turn of the base unseen by the encoders | rad/m |
| 7 | camera height minus its nominal value | m |
| 8 | true focal length / nominal focal length - 1 | 1 |
| 9 + 3 i ... 11 + 3 i | x, y, z of LED i in `map` | m |

The projection is the pinhole of `goalreach_msgs_py.camera`, its derivatives are analytic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.values import FloatArray

__all__ = [
    'DRIFT',
    'FOCAL',
    'HEADING',
    'HEIGHT',
    'LEDS',
    'PAN_BIAS',
    'SCALE',
    'TILT_BIAS',
    'Lens',
    'Projection',
    'project',
    'state_jacobian',
]

HEADING: Final = 2
PAN_BIAS: Final = 3
TILT_BIAS: Final = 4
SCALE: Final = 5
DRIFT: Final = 6
HEIGHT: Final = 7
FOCAL: Final = 8
LEDS: Final = 9

_MINIMUM_DEPTH_M = 0.05
"""Nearer than this, or behind, a point has no pixel. Chosen, not from the paper."""


@dataclass(frozen=True, kw_only=True)
class Lens:
    """Focal lengths and principal point as arrays, made once per camera.

    Attributes:
        focal_px: (2,) focal lengths along u and v.
        centre_px: (2,) principal point.
    """

    focal_px: FloatArray
    centre_px: FloatArray

    @classmethod
    def of_camera(cls, camera: PinholeCamera) -> Lens:
        """Return the ideal part of a camera: its distortion is not in here."""
        return cls(
            focal_px=np.array([camera.fx_px, camera.fy_px]),
            centre_px=np.array([camera.cx_px, camera.cy_px]),
        )

    def scaled(self, relative_error: float) -> Lens:
        """Return the lens with its focal lengths longer by a relative error."""
        return Lens(focal_px=self.focal_px * (1.0 + relative_error), centre_px=self.centre_px)


@dataclass(frozen=True)
class Projection:
    """Pixels of k LEDs and their derivatives; every array may have leading batch axes.

    Attributes:
        pixels_px: (..., k, 2) pixels (u, v).
        depth_m: (..., k) distance along the optical axis; not above 0.05 where behind.
        by_led: (..., k, 2, 3) derivative by the LED's place; minus that by the camera's.
        by_azimuth: (..., k, 2) derivative by the azimuth of the optical axis.
        by_tilt: (..., k, 2) derivative by the tilt.
        by_focal: (..., k, 2) derivative by the relative error of the focal length.
    """

    pixels_px: FloatArray
    depth_m: FloatArray
    by_led: FloatArray
    by_azimuth: FloatArray
    by_tilt: FloatArray
    by_focal: FloatArray


def project(offsets_m: FloatArray, rotation: FloatArray, lens: Lens) -> Projection:
    """Project LEDs into a camera and differentiate.

    With P = R d the LED in the optical frame and s = (P_x, P_y) / P_z, the pixel is c + f s;
    its derivative by d is f / P_z (R_xy - s R_z). A turn of the axis by dA moves d by
    (d_y, -d_x, 0) dA as the camera sees it; a tilt by dT moves P by (0, P_z, -P_y) dT.

    Args:
        offsets_m: (..., k, 3) LED minus optical centre in `map`, metres.
        rotation: (..., 3, 3) from `map` to the optical frame.
        lens: The lens.

    Returns:
        The projection; points behind the camera are held at a depth of 0.05 m.
    """
    in_camera_m = offsets_m @ rotation.swapaxes(-1, -2)
    depth_m = np.maximum(in_camera_m[..., 2:], _MINIMUM_DEPTH_M)
    slopes = in_camera_m[..., :2] / depth_m
    rays_px = slopes * lens.focal_px
    turned = rotation[..., None, :2, :] - slopes[..., None] * rotation[..., None, 2:, :]
    by_led = (lens.focal_px / depth_m)[..., None] * turned
    by_azimuth = by_led[..., 0] * offsets_m[..., 1:2] - by_led[..., 1] * offsets_m[..., :1]
    by_tilt = rays_px * slopes[..., 1:]
    by_tilt[..., 1] += lens.focal_px[1]
    return Projection(
        lens.centre_px + rays_px, depth_m[..., 0], by_led, by_azimuth, by_tilt, rays_px
    )


def state_jacobian(projection: Projection, leds: NDArray[np.intp], state_size: int) -> FloatArray:
    """Return the derivative of the pixels by the whole state vector.

    Args:
        projection: k LEDs, with or without leading batch axes of one dimension.
        leds: (..., k) index of the LED of each row.
        state_size: Length of the state vector.

    Returns:
        (..., 2 k, state_size), rows u_0, v_0, u_1, v_1, ...
    """
    shape = projection.pixels_px.shape
    jacobian = np.zeros((*shape, state_size))
    jacobian[..., :2] = -projection.by_led[..., :2]
    jacobian[..., HEADING] = projection.by_azimuth
    jacobian[..., PAN_BIAS] = projection.by_azimuth
    jacobian[..., TILT_BIAS] = projection.by_tilt
    jacobian[..., HEIGHT] = -projection.by_led[..., 2]
    jacobian[..., FOCAL] = projection.by_focal
    places = jacobian[..., LEDS:].reshape(-1, 2, (state_size - LEDS) // 3, 3)
    rows = np.arange(len(places))
    places[rows, :, leds.reshape(-1)] = projection.by_led.reshape(-1, 2, 3)
    jacobian[..., LEDS:] = places.reshape(*shape, state_size - LEDS)
    return jacobian.reshape(*shape[:-2], 2 * shape[-2], state_size)
