"""Projection of the LEDs into the image: lens, posts, rolling shutter and emission."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from goalreach_msgs_py.angles import deg
from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import FloatArray


def emission_axes(landmarks_m: FloatArray, width_m: float, length_m: float) -> FloatArray:
    """Return the axis of each LED, which points away from its wall into the arena.

    Args:
        landmarks_m: (n, 3) LEDs in `map`.
        width_m: Arena size along x.
        length_m: Arena size along y.

    Returns:
        (n, 3) horizontal unit vectors, the inward normal of the nearest wall; the goal wall at a
        tie.
    """
    normals = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    x_m, y_m = landmarks_m[:, 0], landmarks_m[:, 1]
    gaps_m = np.stack([y_m, x_m, width_m - x_m, length_m - y_m], axis=1)
    axes: FloatArray = normals[np.argmin(gaps_m, axis=1)]
    return axes


def emission_exponent(half_angle_rad: float) -> float:
    """Return n such that cos(angle / 2)^n is one half at the half angle."""
    return math.log(0.5) / math.log(math.cos(half_angle_rad / 2.0))


def emission(cosine: float, exponent: float) -> float:
    """Return the strength of an LED off its axis, relative to that on its axis.

    Models a domed LED by cos(angle / 2)^n: one on the axis, zero straight behind.

    Args:
        cosine: Cosine of the angle between its axis and the line of sight.
        exponent: n, from `emission_exponent`.
    """
    squared = 0.5 * (1.0 + cosine)  # cos^2 of half the angle
    return float(squared ** (0.5 * exponent)) if squared > 0.0 else 0.0


Post = tuple[float, float, float, float]
"""x and y of the axis in `map`, radius, height; metres."""


def posts_from_flat(values: Sequence[float]) -> tuple[Post, ...]:
    """Return the posts of a flat sequence x, y, radius, height, x, y, ..."""
    numbers = iter(values)
    return tuple(zip(numbers, numbers, numbers, numbers, strict=True))


def is_hidden(camera_m: Sequence[float], led_m: Sequence[float], posts: Sequence[Post]) -> bool:
    """Return whether a post blocks the line of sight from the camera to an LED.

    Args:
        camera_m: Optical centre x, y, z in `map`.
        led_m: LED x, y, z in `map`.
        posts: The posts.
    """
    x_m, y_m, z_m = camera_m
    dx_m, dy_m, dz_m = (led_m[k] - camera_m[k] for k in range(3))
    square = dx_m * dx_m + dy_m * dy_m
    if square == 0.0:
        return False
    for post_x_m, post_y_m, radius_m, height_m in posts:
        nearest = ((post_x_m - x_m) * dx_m + (post_y_m - y_m) * dy_m) / square
        gap_x_m = x_m + nearest * dx_m - post_x_m
        gap_y_m = y_m + nearest * dy_m - post_y_m
        chord = radius_m * radius_m - gap_x_m * gap_x_m - gap_y_m * gap_y_m
        if chord <= 0.0:
            continue
        half = math.sqrt(chord / square)
        enter, leave = max(nearest - half, 0.0), min(nearest + half, 1.0)
        if enter < leave and z_m + min(enter * dz_m, leave * dz_m) <= height_m:
            return True
    return False


_ROLLING_STEPS = 3
"""Fixed-point iterations for the row of a moving LED; each reduces the error a hundredfold."""

_WIDEST = 5.0
"""Largest tangent of the off-axis angle considered for a distorted lens; chosen."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraPose:
    """Pose and velocity of the camera.

    Attributes:
        centre_m: (3,) optical centre in `map`.
        azimuth_rad: Azimuth of the optical axis in `map`.
        tilt_rad: Its elevation, upward.
        velocity_m_per_s: (3,) velocity of the centre in `map`.
        azimuth_rad_per_s: Rate of the azimuth.
        tilt_rad_per_s: Rate of the elevation.
    """

    centre_m: FloatArray
    azimuth_rad: float
    tilt_rad: float
    velocity_m_per_s: FloatArray
    azimuth_rad_per_s: float
    tilt_rad_per_s: float


class CameraView:
    """Projects the LEDs into the image.

    Args:
        camera: The real lens.
        landmarks_m: (n, 3) true positions of the LEDs in `map`.
        posts: Posts that may hide them.
        rolling_exposure_s: Time from the exposure of the top row to that of the bottom row, whose
            exposure is at the image's stamp; 0 for a global shutter.
    """

    def __init__(
        self,
        camera: PinholeCamera,
        landmarks_m: FloatArray,
        *,
        posts: tuple[Post, ...] = (),
        rolling_exposure_s: float = 0.0,
    ) -> None:
        self._camera = camera
        self._landmark_lists: list[list[float]] = landmarks_m.tolist()
        self._posts = posts
        self._rolling_exposure_s = rolling_exposure_s
        self._widest = _monotonic_radius(camera)

    def pixels(self, pose: CameraPose) -> list[tuple[float, float]]:
        """Return the pixel (u, v) of each LED; NaN where it is behind the camera or hidden."""
        pixels = self._project(self._landmark_lists, pose, 0.0)
        if self._rolling_exposure_s > 0.0:
            for index, (_, v_px) in enumerate(pixels):
                pixels[index] = self._at_its_row(index, v_px, pose)
        if self._posts:
            centre_m = pose.centre_m.tolist()
            for index, led_m in enumerate(self._landmark_lists):
                if is_hidden(centre_m, led_m, self._posts):
                    pixels[index] = (math.nan, math.nan)
        return pixels

    def _project(
        self, points_m: list[list[float]], pose: CameraPose, time_s: float
    ) -> list[tuple[float, float]]:
        """Return the pixels at a time relative to the stamp; plain floats suit a few points."""
        right, down, forward = optical_rotation(
            pose.azimuth_rad + time_s * pose.azimuth_rad_per_s,
            pose.tilt_rad + time_s * pose.tilt_rad_per_s,
        ).tolist()
        cx_m, cy_m, cz_m = (pose.centre_m + time_s * pose.velocity_m_per_s).tolist()
        pixels = []
        for px_m, py_m, pz_m in points_m:
            dx_m, dy_m, dz_m = px_m - cx_m, py_m - cy_m, pz_m - cz_m
            x_m = right[0] * dx_m + right[1] * dy_m + right[2] * dz_m
            y_m = down[0] * dx_m + down[1] * dy_m + down[2] * dz_m
            z_m = forward[0] * dx_m + forward[1] * dy_m + forward[2] * dz_m
            if self._widest < _WIDEST and math.hypot(x_m, y_m) > self._widest * z_m:
                pixels.append((math.nan, math.nan))
            else:
                pixels.append(self._camera.project_point(x_m, y_m, z_m))
        return pixels

    def _at_its_row(self, index: int, v_px: float, pose: CameraPose) -> tuple[float, float]:
        """Return the pixel of an LED at the exposure time of the row it falls on."""
        u_px, last_row = math.nan, self._camera.height_px - 1
        point_m = self._landmark_lists[index : index + 1]
        for _ in range(_ROLLING_STEPS):
            if math.isnan(v_px):
                break
            row = min(max(v_px, 0.0), float(last_row))
            time_s = (row / last_row - 1.0) * self._rolling_exposure_s
            u_px, v_px = self._project(point_m, pose, time_s)[0]
        return u_px, v_px


def _monotonic_radius(camera: PinholeCamera) -> float:
    """Return the tangent of the off-axis angle up to which a distorted lens is one-to-one.

    Beyond it the Brown-Conrady polynomial turns back and would map points out of view into it.
    """
    if not any(camera.distortion):
        return _WIDEST
    k1, k2, _, _, k3 = camera.distortion
    radii = np.linspace(0.0, _WIDEST, 1000)
    r2 = radii * radii
    slope = 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3))
    turning = np.flatnonzero(slope <= 0.0)
    return float(radii[turning[0]]) if len(turning) else _WIDEST


@dataclass(frozen=True, kw_only=True)
class OpticsConfig(Configuration):
    """Light, exposure and grey values; none of these figures is in the paper."""

    dark_offset_dn: float = parameter(
        10.0, 'Mean grey value without light; chosen', within=(0.0, 100.0)
    )
    led_flux_dn: float = parameter(
        18000.0,
        'Sum of the grey values of an LED 1 m away on its axis; chosen for a peak of 75 at 5 m',
        within=(0.0, 1e7),
    )
    led_radius_m: float = parameter(
        0.0025, 'Radius of the luminous disc of an LED, m; a common 5 mm LED', within=(0.0, 0.1)
    )
    led_half_angle_rad: float = parameter(
        deg(60),
        'Angle off axis at which an LED has half its intensity, rad; chosen',
        within=(deg(5), deg(175)),
    )
    shot_noise: float = parameter(
        0.0,
        'Shot noise of light: standard deviation over the root of the grey value; 0 for none',
        within=(0.0, 10.0),
    )
    rolling_exposure_s: float = parameter(
        0.0,
        'Time from the exposure of the top row to that of the bottom row, which is at the stamp, '
        's; 0 for a global shutter, as in the CCD of the robot',
        within=(0.0, 1.0),
    )
