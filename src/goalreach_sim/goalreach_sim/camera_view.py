"""Projection of the LEDs into the image: lens, obstacles and emission."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np

from goalreach_msgs_py.angles import deg
from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import FloatArray


def emission_axes(landmarks_m: FloatArray, width_m: float, length_m: float) -> FloatArray:
    """Return the axis of each LED, which points away from its wall into the arena, (n, 3).

    It is the inward normal of the nearest wall; of the goal wall at a tie.
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

    Models a domed LED by cos(angle / 2)^n, n by `emission_exponent`: one on the axis, zero
    straight behind. The cosine is that of the angle between its axis and the line of sight.
    """
    squared = 0.5 * (1.0 + cosine)  # cos^2 of half the angle
    return float(squared ** (0.5 * exponent)) if squared > 0.0 else 0.0


def is_hidden(
    camera_m: Sequence[float], led_m: Sequence[float], obstacles: Iterable[Obstacle]
) -> bool:
    """Return whether an obstacle blocks the line of sight from the camera to an LED."""
    x_m, y_m, z_m = camera_m
    dx_m, dy_m, dz_m = (led_m[k] - camera_m[k] for k in range(3))
    if dx_m == dy_m == 0.0:
        return False
    for one in obstacles:
        if one.height_m < min(z_m, led_m[2]):
            continue
        if (chord := one.chord(x_m, y_m, dx_m, dy_m)) is not None:
            enter, leave = max(chord[0], 0.0), min(chord[1], 1.0)
            if enter < leave and z_m + min(enter * dz_m, leave * dz_m) <= one.height_m:
                return True
    return False


class CameraPose(NamedTuple):
    """Pose and velocity of the camera.

    Attributes:
        centre_m: (3,) optical centre in `map`.
        azimuth_rad: Azimuth of the optical axis in `map`.
        tilt_rad: Its elevation, upward.
        velocity_m_per_s: (3,) velocity of the centre in `map`.
        azimuth_rad_per_s: Rate of the azimuth.
        tilt_rad_per_s: Rate of the elevation.
        level_rad: Small rotation of the base, and of the camera with it, about x and y of `map`.
    """

    centre_m: FloatArray
    azimuth_rad: float
    tilt_rad: float
    velocity_m_per_s: FloatArray
    azimuth_rad_per_s: float
    tilt_rad_per_s: float
    level_rad: tuple[float, float] = (0.0, 0.0)


@dataclass(eq=False)
class CameraView:
    """Projects LEDs, or other points, into the image.

    Attributes:
        camera: The real lens.
        points_m: (n, 3) true positions of the points in `map`.
        obstacles: What may hide them.
    """

    camera: PinholeCamera
    points_m: FloatArray
    obstacles: Sequence[Obstacle] = ()

    def __post_init__(self) -> None:
        self._points_m: list[list[float]] = self.points_m.tolist()

    def pixels(self, pose: CameraPose, time_s: float = 0.0) -> list[tuple[float, float]]:
        """Return the pixel (u, v) of each point; NaN where it is behind the camera or hidden.

        The camera has moved on for a time since the stamp of its pose. Plain floats suit a few
        points.
        """
        right, down, forward = optical_rotation(
            pose.azimuth_rad + time_s * pose.azimuth_rad_per_s,
            pose.tilt_rad + time_s * pose.tilt_rad_per_s,
        ).tolist()
        moved_m = time_s * pose.velocity_m_per_s if time_s else 0.0
        (cx_m, cy_m, cz_m), (wx, wy) = (pose.centre_m + moved_m).tolist(), pose.level_rad
        pixels = []
        for px_m, py_m, pz_m in self._points_m:
            east_m, north_m, dz_m = px_m - cx_m, py_m - cy_m, pz_m - cz_m
            dx_m, dy_m = east_m - wy * dz_m, north_m + wx * dz_m
            dz_m += wy * east_m - wx * north_m
            x_m = right[0] * dx_m + right[1] * dy_m + right[2] * dz_m
            y_m = down[0] * dx_m + down[1] * dy_m + down[2] * dz_m
            z_m = forward[0] * dx_m + forward[1] * dy_m + forward[2] * dz_m
            pixels.append(self.camera.project_point(x_m, y_m, z_m))
        if self.obstacles:
            centre_m = pose.centre_m.tolist()
            for index, point_m in enumerate(self._points_m):
                if is_hidden(centre_m, point_m, self.obstacles):
                    pixels[index] = (math.nan, math.nan)
        return pixels


@dataclass(frozen=True, kw_only=True)
class OpticsConfig(Configuration):
    """Light, exposure and grey values; none of these figures is in the paper."""

    dark_offset_dn: float = parameter(
        10.0, 'Mean grey value without light; chosen', within=(0.0, 100.0)
    )
    led_flux_dn: float = parameter(
        18000.0,
        'Sum of the grey values of an LED 1 m away; chosen: its peak is 75 at 5 m',
        within=(0.0, 1e7),
    )
    led_radius_m: float = parameter(
        0.0025, 'Radius of the luminous disc of an LED, m; a common 5 mm LED', within=(0.0, 0.1)
    )
    led_half_angle_rad: float = parameter(
        deg(60),
        'Angle off axis of half the intensity of an LED, rad; chosen',
        within=(deg(5), deg(175)),
    )
    tag_white_dn: float = parameter(
        140.0, 'Grey value of the white of tags; chosen', within=(0.0, 255.0)
    )
