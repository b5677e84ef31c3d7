"""Poses without a past: from one image, or from the lights of a turning head."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.association import Fix, identify
from goalreach_perception.landmark_tracking import MatchedLeds
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import HEADING, PAN_BIAS, TILT_BIAS, Lens, Optics
from goalreach_perception.one_image_pose import ImageGeometry
from goalreach_perception.pose_filter import PoseFilter

_STILL_M = 0.01
"""A robot that moved less than this has not moved. Chosen."""
_SAME_RAD = math.radians(0.5)
"""Lights in directions nearer than this are one. Chosen: many times the encoder noise."""
_MOST = 12
_LEAST_HITS = 3
"""A light seen once may be spurious; three spurious ones in one direction do not occur. Chosen."""
_PANORAMA_INFLATION = 4.0
"""The filter does not keep how errors of a panorama correlate with those of the survey, so its
covariance is made larger. Chosen."""
_PANORAMA_SIGMA_M = 0.15
"""A panorama that is less sure than this is not used: from afar one image holds all LEDs, and is
far better. Chosen."""


@dataclass(frozen=True)
class DirectedSpots:
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

    def sightings(self, most: int) -> DirectedSpots:
        """Return the lights that were seen three times or more, those seen most often first.

        Args:
            most: How many at most.
        """
        lights = sorted(self._lights, key=lambda light: -light.hits)
        lights = [light for light in lights if light.hits >= _LEAST_HITS][:most]
        return DirectedSpots(
            np.array([light.pixel_px for light in lights]).reshape(-1, 2),
            np.array([light.sigma_px for light in lights]),
            np.array([light.turn_rad for light in lights]),
            np.array([light.tilt_rad for light in lights]),
        )


class Acquisition:
    """Finds poses from lights that nobody expected.

    Args:
        config: Everything tunable.
        state: The filter; what it knows of biases and the survey is used, its pose is not.
    """

    def __init__(self, config: LocalizerConfig, state: PoseFilter) -> None:
        self._config = config
        self._state = state
        self._panorama = Panorama(config.noise.pan_tilt_noise_rad)

    def clear(self) -> None:
        """Forget the lights of earlier images."""
        self._panorama.clear()

    def from_image(self, seen: MatchedLeds, joints: HeadAngles, optics: Optics) -> Fix | None:
        """Return the pose and labelling that explain the lights of one image, or None.

        Args:
            seen: The lights; the names they may have are not used.
            joints: Encoder readings.
            optics: The lens.
        """
        count = len(seen.pixels_px)
        image = DirectedSpots(
            seen.pixels_px,
            seen.spots.sigmas_px,
            np.zeros(count),
            np.full(count, joints.tilt_rad),
        )
        return self._solve(image, optics)

    def from_panorama(
        self, lights: MatchedLeds, joints: HeadAngles, odometry: Pose2, optics: Optics
    ) -> tuple[Pose2, FloatArray] | None:
        """Add an image; return the pose that its lights and earlier ones tell together.

        Each of the lights used was seen three times or more, so even two need no confirmation:
        neither is a spurious light, and no other pose fits them.

        Args:
            lights: The lights of the image.
            joints: Encoder readings.
            odometry: Odometry pose.
            optics: The lens.

        Returns:
            The pose in `map` with its (3, 3) covariance of x, y, heading; None where there is
            none, or none that is sure enough.
        """
        gained = self._panorama.add(
            lights.pixels_px,
            lights.spots.sigmas_px,
            lens=optics.lens,
            joints=joints,
            odometry=odometry,
        )
        if not gained:
            return None
        sightings = self._panorama.sightings(self._config.detection.maximum_spots)
        fix = self._solve(sightings, optics)
        if fix is None:
            return None
        covariance = np.asarray(_PANORAMA_INFLATION * np.linalg.inv(fix.information), np.float64)
        if covariance[0, 0] + covariance[1, 1] > _PANORAMA_SIGMA_M**2:
            return None
        covariance[2, 2] += self._state.covariance[PAN_BIAS, PAN_BIAS]
        heading = odometry.heading_rad + fix.azimuth_rad - float(self._state.mean[PAN_BIAS])
        return Pose2(x_m=fix.x_m, y_m=fix.y_m, heading_rad=heading), covariance

    def distance2(self, fix: Fix, joints: HeadAngles) -> float:
        """Return the squared distance of the filter's pose from a fix, 3 degrees of freedom.

        Their errors are taken as independent; since they share those of the survey, the true
        distance is larger, never smaller.

        Args:
            fix: A pose from one image.
            joints: Encoder readings of that image.
        """
        mean = self._state.mean
        azimuth = float(mean[HEADING] + mean[PAN_BIAS]) + joints.turret_rad + joints.pan_rad
        turned = angle_difference(azimuth, fix.azimuth_rad)
        difference = np.array([mean[0] - fix.x_m, mean[1] - fix.y_m, turned])
        to_azimuth = np.zeros((3, len(mean)))
        to_azimuth[[0, 1, 2, 2], [0, 1, HEADING, PAN_BIAS]] = 1.0
        covariance = to_azimuth @ self._state.covariance @ to_azimuth.T
        covariance += np.linalg.inv(fix.information)
        covariance[2, 2] += self._config.noise.pan_tilt_noise_rad**2
        return float(difference @ np.linalg.solve(covariance, difference))

    def _solve(self, sightings: DirectedSpots, optics: Optics) -> Fix | None:
        """Return the pose and labelling that explain lights, or None."""
        state = self._state
        geometry = ImageGeometry(
            leds_m=state.leds_m,
            camera_height_m=state.camera_height_m,
            turns_rad=sightings.turns_rad,
            tilts_rad=sightings.tilts_rad + float(state.mean[TILT_BIAS]),
            lens=optics.lens.scaled(state.focal_error),
            nuisance_covariance=state.covariance,
            tilt_noise_rad=self._config.noise.pan_tilt_noise_rad,
        )
        return identify(
            geometry,
            sightings.pixels_px,
            sightings.sigmas_px,
            arena_size_m=(self._config.arena_width_m, self._config.arena_length_m),
            config=self._config.association,
        )
