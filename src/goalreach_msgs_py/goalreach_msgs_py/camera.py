"""The pinhole camera on its turret, pan and tilt joints, shared by simulator and localizer.

Frames: `map` with z up; `camera_optical_frame` with x right, y down, z forward (REP-103). The
optical centre is here on the robot's vertical axis; callers add what a mount moves it by.
"""

from dataclasses import dataclass
import functools
import math
from typing import Any, Final, TypeVar

import numpy as np

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import FloatArray, HeadAngles

_NEAREST_M = 1e-3
"""Smallest depth of a point in front of the camera. Chosen."""
_MINIMUM_PX, _MAXIMUM_PX = 0.01, 1e7
"""Range of sizes and focal lengths. Chosen to include every camera."""
_MAXIMUM_DISTORTION = 1e3
"""Largest distortion term. Chosen to include every lens."""

PLUMB_BOB: Final = 'plumb_bob'
RATIONAL: Final = 'rational_polynomial'
EQUIDISTANT: Final = 'equidistant'
DISTORTION_TERMS: Final = {PLUMB_BOB: 5, RATIONAL: 8, EQUIDISTANT: 4}
"""Number of terms of each distortion model (sensor_msgs, distortion_models.hpp)."""
_WIDEST = 5.0
"""Largest tangent of the angle from the axis that is looked at for a distorted lens. Chosen."""
_ON_AXIS = 1e-12
"""Added to the tangent of an angle, so that a point on the axis divides by no zero."""

_Number = TypeVar('_Number', float, FloatArray)


@dataclass(frozen=True, kw_only=True)
class PinholeCamera:
    """Intrinsics as in sensor_msgs/CameraInfo; pixel (0, 0) is the top-left pixel's centre.

    Attributes:
        width_px: Image width.
        height_px: Image height.
        fx_px: Focal length along u.
        fy_px: Focal length along v.
        cx_px: Principal point, u.
        cy_px: Principal point, v.
        distortion: The terms of the model; all zero of the first two for an ideal lens.
        distortion_model: 'plumb_bob' (Brown-Conrady k1, k2, p1, p2, k3), 'rational_polynomial'
            (k1, k2, p1, p2, k3, k4, k5, k6, the last three in the denominator) or 'equidistant'
            (k1, k2, k3, k4 of Kannala and Brandt, "A generic camera model and calibration method
            for conventional, wide-angle, and fish-eye lenses", PAMI 2006).
    """

    width_px: int = 640
    height_px: int = 480
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    distortion_model: str = PLUMB_BOB

    def __post_init__(self) -> None:
        for name in ('width_px', 'height_px', 'fx_px', 'fy_px'):
            value = getattr(self, name)
            if not _MINIMUM_PX <= value <= _MAXIMUM_PX:
                allowed = f'a number in [{_MINIMUM_PX:g}, {_MAXIMUM_PX:g}]'
                raise ConfigurationError(name, value, allowed)
        for name in ('cx_px', 'cy_px'):
            if not abs(getattr(self, name)) <= _MAXIMUM_PX:
                raise ConfigurationError(name, getattr(self, name), 'a finite number of pixels')
        terms = DISTORTION_TERMS.get(self.distortion_model)
        if terms is None:
            allowed = 'one of ' + ', '.join(DISTORTION_TERMS)
            raise ConfigurationError('distortion_model', self.distortion_model, allowed)
        if len(self.distortion) != terms:
            allowed = f'{terms} numbers for {self.distortion_model}'
            raise ConfigurationError('distortion', self.distortion, allowed)
        if not all(abs(term) <= _MAXIMUM_DISTORTION for term in self.distortion):
            raise ConfigurationError('distortion', self.distortion, 'finite numbers')

    @classmethod
    def from_field_of_view(
        cls, *, width_px: int = 640, height_px: int = 480, horizontal_fov_rad: float
    ) -> 'PinholeCamera':
        """Return an ideal camera with square pixels and a centred principal point.

        The field of view is the full angle between the outer edges of the first and last column.
        """
        focal_px = width_px / 2.0 / math.tan(horizontal_fov_rad / 2.0)
        return cls(
            width_px=width_px,
            height_px=height_px,
            fx_px=focal_px,
            fy_px=focal_px,
            cx_px=(width_px - 1) / 2.0,
            cy_px=(height_px - 1) / 2.0,
        )

    @functools.cached_property
    def is_distorted(self) -> bool:
        """Whether the lens differs from a pinhole; without terms, an equidistant one does."""
        return self.distortion_model == EQUIDISTANT or any(self.distortion)

    @functools.cached_property
    def widest(self) -> float:
        """Tangent of the angle from the axis up to which a distorted lens is one-to-one.

        Beyond it a polynomial turns back and would map points out of view into it.
        """
        radii = np.linspace(0.0, _WIDEST, 1000).astype(np.float64)
        ahead, behind = (self.distort(x, np.zeros_like(radii))[0] for x in (radii, -radii))
        turning = np.flatnonzero(np.diff(ahead - behind) <= 0.0)  # tangential terms cancel
        return float(radii[turning[0]]) if len(turning) else math.inf

    def project(self, points_m: FloatArray) -> FloatArray:
        """Return the pixels of points given in the optical frame.

        Args:
            points_m: (n, 3) points, metres, x right, y down, z forward.

        Returns:
            (n, 2) pixels (u, v); NaN where a point is not in front of the camera (z <= 1 mm), or
            farther from its axis than the distortion is one-to-one.
        """
        depth_m = points_m[:, 2]
        with np.errstate(divide='ignore', invalid='ignore'):
            x = np.where(depth_m > _NEAREST_M, points_m[:, 0] / depth_m, np.nan)
            y = points_m[:, 1] / depth_m
        if self.is_distorted:
            x[np.hypot(x, y) > self.widest] = np.nan
            x, y = self.distort(x, y)
        pixels = np.empty((len(points_m), 2))
        pixels[:, 0] = self.cx_px + self.fx_px * x
        pixels[:, 1] = np.where(np.isnan(x), np.nan, self.cy_px + self.fy_px * y)
        return pixels

    def project_point(self, x_m: float, y_m: float, z_m: float) -> tuple[float, float]:
        """Return the pixel of a point, x right, y down, z forward: `project` without arrays."""
        if not z_m > _NEAREST_M:
            return math.nan, math.nan
        x, y = x_m / z_m, y_m / z_m
        if self.is_distorted:
            if math.hypot(x, y) > self.widest:
                return math.nan, math.nan
            x, y = self.distort(x, y)
        return self.cx_px + self.fx_px * x, self.cy_px + self.fy_px * y

    def distort(self, x: _Number, y: _Number) -> tuple[_Number, _Number]:
        """Return where a distorted lens puts a ray (x, y, 1), in focal lengths from its axis."""
        r2 = x * x + y * y
        if self.distortion_model == EQUIDISTANT:
            k1, k2, k3, k4 = self.distortion
            tangent: Any = np.sqrt(r2) + _ON_AXIS
            angle = np.arctan(tangent)
            a2 = angle * angle
            scale = angle / tangent * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))))
            return x * scale, y * scale
        k1, k2, p1, p2, k3, *denominator = self.distortion
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        if denominator:
            k4, k5, k6 = denominator
            radial = radial / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        return (
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )


def camera_azimuth(heading_rad: float, head: HeadAngles) -> float:
    """Return the azimuth of the optical axis in `map`: heading + turret + pan, not wrapped."""
    return heading_rad + head.turret_rad + head.pan_rad


def optical_rotation(azimuth_rad: float, tilt_rad: float) -> FloatArray:
    """Return the rotation from `map` to the optical frame.

    The optical axis has an azimuth in `map` and a tilt, upward.

    Returns:
        (3, 3): the rows are the camera's right, down and forward axes in `map`.
    """
    ca, sa = math.cos(azimuth_rad), math.sin(azimuth_rad)
    ct, st = math.cos(tilt_rad), math.sin(tilt_rad)
    return np.array([[sa, -ca, 0.0], [ca * st, sa * st, -ct], [ca * ct, sa * ct, st]])
