"""Poses without a past: from one image, or from the lights of a turning head."""

from __future__ import annotations

import numpy as np

from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.association import Fix, identify
from goalreach_perception.landmark_tracking import SeenLeds
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import HEADING, PAN_BIAS, TILT_BIAS, Optics
from goalreach_perception.one_image_pose import ImageGeometry
from goalreach_perception.panorama import Panorama, Sightings
from goalreach_perception.pose_filter import PoseFilter

_PANORAMA_INFLATION = 4.0
"""The filter does not keep how errors of a panorama correlate with those of the survey, so its
covariance is made larger. Chosen."""
_PANORAMA_SIGMA_M = 0.15
"""A panorama that is less sure than this is not used: from afar one image holds all LEDs, and is
far better. Chosen."""


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

    def from_image(self, seen: SeenLeds, joints: HeadAngles, optics: Optics) -> Fix | None:
        """Return the pose and labelling that explain the lights of one image, or None.

        Args:
            seen: The lights; the names they may have are not used.
            joints: Encoder readings.
            optics: The lens.
        """
        count = len(seen.pixels_px)
        image = Sightings(
            seen.pixels_px,
            seen.spots.sigmas_px,
            np.zeros(count),
            np.full(count, joints.tilt_rad),
        )
        return self._solve(image, optics)

    def from_panorama(
        self, lights: SeenLeds, joints: HeadAngles, odometry: Pose2, optics: Optics
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

    def _solve(self, sightings: Sightings, optics: Optics) -> Fix | None:
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
