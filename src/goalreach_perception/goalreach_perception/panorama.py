"""Lights seen one after the other while the head turns, kept as one wide image."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.measurement_model import Lens

_STILL_M = 0.01
"""A robot that moved less than this has not moved. Chosen."""
_SAME_RAD = math.radians(0.5)
"""Lights in directions nearer than this are one. Chosen: many times the encoder noise."""
_MOST = 12
_LEAST_HITS = 3
"""A light seen once may be spurious; three spurious ones in one direction do not occur. Chosen."""


@dataclass(frozen=True)
class Sightings:
    """Lights with the way the camera looked when it saw them.

    Attributes:
        pixels_px: (n, 2) ideal pixels.
        sigmas_px: (n,) standard deviation per axis.
        turns_rad: (n,) azimuth of the optical axis less that of a common direction.
        tilts_rad: (n,) tilt by the encoder.
    """

    pixels_px: FloatArray
    sigmas_px: FloatArray
    turns_rad: FloatArray
    tilts_rad: FloatArray


@dataclass
class _Light:
    azimuth_rad: float
    rise_rad: float
    pixel_px: tuple[float, float]
    sigma_px: float
    turn_rad: float
    tilt_rad: float
    hits: int = 1


class Panorama:
    """Collects lights by direction while the robot stands still.

    Directions are kept relative to odometry's zero heading, so the robot may steer.

    Args:
        encoder_sigma_rad: Noise of pan and tilt encoders: not common to different images.
    """

    def __init__(self, encoder_sigma_rad: float) -> None:
        self._encoder_sigma_rad = encoder_sigma_rad
        self._lights: list[_Light] = []
        self._place_m: tuple[float, float] | None = None

    def clear(self) -> None:
        """Forget everything."""
        self._lights = []
        self._place_m = None

    def add(
        self,
        pixels_px: FloatArray,
        sigmas_px: FloatArray,
        *,
        lens: Lens,
        joints: HeadAngles,
        odometry: Pose2,
    ) -> bool:
        """Add the lights of one image.

        Args:
            pixels_px: (n, 2) ideal pixels.
            sigmas_px: (n,) standard deviation per axis.
            lens: The lens.
            joints: Encoder readings.
            odometry: Odometry pose; a robot that moved makes the lights of before useless.

        Returns:
            Whether lights were added that the panorama makes more of than this image alone.
        """
        place_m = (odometry.x_m, odometry.y_m)
        if self._place_m is None or math.dist(place_m, self._place_m) > _STILL_M:
            self.clear()
            self._place_m = place_m
        turn = odometry.heading_rad + joints.turret_rad + joints.pan_rad
        slopes = ((pixels_px - lens.centre_px) / lens.focal_px).tolist()
        noise_px = self._encoder_sigma_rad * float(lens.focal_px.max())
        ct, st = math.cos(joints.tilt_rad), math.sin(joints.tilt_rad)
        for (right, down), (u_px, v_px), sigma in zip(
            slopes, pixels_px.tolist(), sigmas_px.tolist(), strict=True
        ):
            forward = ct + st * down
            spread = noise_px * (1.0 + right * right + down * down)
            self._note(
                _Light(
                    azimuth_rad=turn - math.atan2(right, forward),
                    rise_rad=math.atan2(st - ct * down, math.hypot(forward, right)),
                    pixel_px=(u_px, v_px),
                    sigma_px=math.hypot(sigma, spread),
                    turn_rad=turn,
                    tilt_rad=joints.tilt_rad,
                )
            )
        return len(slopes) > 0 and len(self._lights) > len(slopes)

    def _note(self, seen: _Light) -> None:
        """Add a light, in place of an earlier one in the same direction."""
        for index, light in enumerate(self._lights):
            near = abs(light.rise_rad - seen.rise_rad) < _SAME_RAD
            if near and abs(wrap_angle(light.azimuth_rad - seen.azimuth_rad)) < _SAME_RAD:
                seen.hits += light.hits
                self._lights[index] = seen
                return
        self._lights.append(seen)
        if len(self._lights) > _MOST:
            self._lights.remove(min(self._lights, key=lambda light: light.hits))

    def sightings(self, most: int) -> Sightings:
        """Return the lights that were seen three times or more, those seen most often first.

        Args:
            most: How many at most.
        """
        lights = sorted(self._lights, key=lambda light: -light.hits)
        lights = [light for light in lights if light.hits >= _LEAST_HITS][:most]
        return Sightings(
            np.array([light.pixel_px for light in lights]).reshape(-1, 2),
            np.array([light.sigma_px for light in lights]),
            np.array([light.turn_rad for light in lights]),
            np.array([light.tilt_rad for light in lights]),
        )
