"""Acquisition of a pose without a prior: from one image, or from a panorama of a turning head."""

from collections.abc import Sequence
import math
from typing import NamedTuple

import numpy as np

from goalreach_msgs_py.angles import angle_difference, wrap_angle
from goalreach_msgs_py.camera import camera_azimuth
from goalreach_msgs_py.tags import CORNERS, Tag
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.association import Fix, identify, identify_labelled
from goalreach_perception.landmark_tracking import MatchedLeds
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import (
    DELAY,
    HEADING,
    LEVEL,
    PAN_BIAS,
    TILT_BIAS,
    Lens,
    Optics,
)
from goalreach_perception.one_image_pose import ImageGeometry
from goalreach_perception.pose_filter import PoseFilter

_STILL_M = 0.01
"""A smaller displacement counts as none. Chosen."""
_SAME_RAD = math.radians(0.5)
"""Spots in directions closer than this are one. Chosen: many times the encoder noise."""
_MOST = 12
_LEAST_HITS = _TRIPLE = 3
"""A spot of one image may be spurious; three in one direction are not. Chosen."""
_SURE_SIGMA_PX = 0.3
"""A spot of a larger error may be part of a wall, and two of those do not make a pose. Chosen:
speckles of textured walls have 0.4 and more, bright LEDs 0.2."""
_BESIDE_PX = 4.0
"""Error of a spot that is not sure where nothing else fits: a lamp beside an LED. Chosen."""
_UNSEEN_RAD = math.radians(5.0)
"""How far below the upper border of the highest images an LED may be missed. Chosen."""
_SIDES_RAD = np.radians(np.arange(-75.0, 76.0, 15.0))
_PANORAMA_INFLATION = 4.0
"""Factor on the covariance of a panorama: the filter ignores the correlation of its errors with
those of the survey. Chosen."""
_PANORAMA_SIGMA_M = 0.15
"""Largest position sigma of a panorama. Chosen: at long range one image holds all LEDs and is far
better."""


class DirectedSpots(NamedTuple):
    """Spots with the direction of the camera in their images.

    Attributes:
        pixels_px: (n, 2) ideal pixels.
        sigmas_px: (n,) standard deviation per axis.
        turns_rad: (n,) azimuth of the optical axis relative to a common direction.
        tilts_rad: (n,) tilt by the encoder.
    """

    pixels_px: FloatArray
    sigmas_px: FloatArray
    turns_rad: FloatArray
    tilts_rad: FloatArray


class _Spot(NamedTuple):
    """A spot of a panorama: direction, row of `DirectedSpots`, in how many images it was."""

    azimuth_rad: float
    rise_rad: float
    row: tuple[Sequence[float], float, float, float]
    is_sure: bool
    hits: int = 1


def _direction(right: float, down: float, tilt_rad: float) -> tuple[float, float]:
    """Return azimuth (to the right) and rise of a ray (right, down, 1) of a tilted camera."""
    cosine, sine = math.cos(tilt_rad), math.sin(tilt_rad)
    forward = cosine + sine * down
    return math.atan2(right, forward), math.atan2(sine - cosine * down, math.hypot(forward, right))


class Panorama:
    """Accumulates spots by direction while the robot stands still.

    Directions are relative to the zero heading of the odometry, so the robot may steer. The noise
    of pan and tilt encoders is independent between images.
    """

    def __init__(self, encoder_sigma_rad: float) -> None:
        self._encoder_sigma_rad = encoder_sigma_rad
        self._spots: list[_Spot] = []
        self._place_m: tuple[float, float] | None = None
        self._late_rad = 0.0

    def clear(self) -> None:
        """Discard all spots."""
        self._spots = []
        self._place_m = None

    def add(
        self,
        pixels_px: FloatArray,
        sigmas_px: FloatArray,
        *,
        lens: Lens,
        joints: HeadAngles,
        odometry: Pose2,
        late_rad: float = 0.0,
    ) -> bool:
        """Add the spots of one image; return whether it has some and the panorama tells more.

        It does if it has two spots or more, and others than these, or these are fewer than three:
        an image of two is not solved alone.

        They are ideal pixels, (n, 2), each with a standard deviation per axis. Earlier spots are
        discarded by a displacement of the odometry, and by another `late_rad`: how far the camera
        turns in the time by which the image may be late.
        """
        place_m = (odometry.x_m, odometry.y_m)
        moved = self._place_m is None or math.dist(place_m, self._place_m) > _STILL_M
        if moved or abs(late_rad - self._late_rad) > _SAME_RAD:
            self.clear()
            self._place_m, self._late_rad = place_m, late_rad
        turn = camera_azimuth(odometry.heading_rad, joints)
        noise_px = self._encoder_sigma_rad * float(lens.focal_px.max())
        slopes = ((pixels_px - lens.centre_px) / lens.focal_px).tolist()
        spots = zip(pixels_px.tolist(), slopes, sigmas_px.tolist(), strict=True)
        for pixel, (right, down), sigma in spots:
            sigma_px = math.hypot(sigma, noise_px * (1.0 + right * right + down * down))
            azimuth, rise = _direction(right, down, joints.tilt_rad)
            row = pixel, sigma_px, turn, joints.tilt_rad
            self._merge(_Spot(turn - azimuth, rise, row, sigma < _SURE_SIGMA_PX))
        more = len(slopes) < _TRIPLE or len(self._spots) > len(slopes)
        return len(slopes) > 0 and len(self._spots) > 1 and more

    def _merge(self, spot: _Spot) -> None:
        """Add a spot; replace earlier ones in the same direction."""
        apart: list[_Spot] = []
        for other in self._spots:
            near = abs(other.rise_rad - spot.rise_rad) < _SAME_RAD
            if near and abs(wrap_angle(other.azimuth_rad - spot.azimuth_rad)) < _SAME_RAD:
                spot = spot._replace(hits=spot.hits + other.hits)
            else:
                apart.append(other)
        self._spots = [*apart, spot]
        if len(self._spots) > _MOST:
            self._spots.remove(min(self._spots, key=lambda spot: spot.hits))

    def frequent_spots(self, count: int, *, unsure_px: float = 0.0) -> DirectedSpots:
        """Return the spots of three images or more, the most frequent ones first.

        Those that are not sure have at least the standard deviation `unsure_px`.
        """
        spots = sorted(self._spots, key=lambda spot: -spot.hits)
        spots = [spot for spot in spots if spot.hits >= _LEAST_HITS][:count]
        if len(spots) < _TRIPLE:
            spots = [spot for spot in spots if spot.is_sure]
        if not spots:
            return DirectedSpots(np.empty((0, 2)), *np.empty((3, 0)))
        found = DirectedSpots(*map(np.array, zip(*(spot.row for spot in spots), strict=True)))
        least_px = [0.0 if spot.is_sure else unsure_px for spot in spots]
        return found._replace(sigmas_px=np.maximum(found.sigmas_px, least_px))


class Acquisition:
    """Solves poses from spots that are not assigned to LEDs.

    The estimates of biases and survey of the filter are used, its pose is not. A search tilts the
    camera up to `search_rad`.
    """

    def __init__(self, config: LocalizerConfig, state: PoseFilter, search_rad: float) -> None:
        self._config = config
        self._state = state
        self._search_rad = search_rad
        self._arena_size_m = (config.arena_width_m, config.arena_length_m)
        self._panorama = Panorama(config.noise.pan_tilt_noise_rad)

    def clear(self) -> None:
        """Discard the spots of earlier images."""
        self._panorama.clear()

    def from_image(self, found: MatchedLeds, joints: HeadAngles, optics: Optics) -> Fix | None:
        """Return the pose and labelling that explain the spots of one image, or None.

        LEDs assigned to them are ignored.
        """
        turns_rad = np.zeros(len(found.pixels_px))
        tilts_rad = np.full(len(turns_rad), joints.tilt_rad)
        sigmas_px = found.spots.sigmas_px
        return self._solve(DirectedSpots(found.pixels_px, sigmas_px, turns_rad, tilts_rad), optics)

    def from_tags(
        self, found: MatchedLeds, tags: Sequence[Tag], joints: HeadAngles, optics: Optics
    ) -> Fix | None:
        """Return the pose that explains the corners of the tags in one image, or None.

        There are four corners for each of the tags. The first guesses are around the largest tag,
        at the range that its height tells.
        """
        quads_px, lens = found.pixels_px.reshape(-1, CORNERS, 2), optics.lens
        heights_px = 0.5 * np.hypot(*(quads_px[:, 2:] - quads_px[:, 1::-1]).sum(axis=1).T)
        row = int(heights_px.argmax())
        right, down = ((quads_px[row].mean(axis=0) - lens.centre_px) / lens.focal_px).tolist()
        tag, (turn, rise) = tags[row], _direction(right, down, joints.tilt_rad)
        range_m = lens.focal_px[1] * tag.size_m * math.cos(rise) / max(heights_px[row], 1.0)
        sides = tag.facing_rad + _SIDES_RAD
        x_m, y_m = tag.x_m + range_m * np.cos(sides), tag.y_m + range_m * np.sin(sides)
        seeds = np.stack([x_m, y_m, sides + math.pi + turn], axis=1)
        count = len(found.leds)
        return identify_labelled(
            self._geometry(np.zeros(count), np.full(count, joints.tilt_rad), optics),
            found.pixels_px,
            found.spots.sigmas_px,
            found.leds,
            seeds=seeds,
            arena_size_m=self._arena_size_m,
            config=self._config.association,
        )

    def from_panorama(
        self, found: MatchedLeds, joints: HeadAngles, odometry: Pose2, optics: Optics
    ) -> tuple[Pose2, FloatArray] | None:
        """Add an image to the panorama; return the pose that explains its spots, or None.

        Every spot used is in three images or more, so that it needs no confirmation. Two are
        enough where no search sees the other LEDs.

        Returns:
            The pose in `map` with its (3, 3) covariance of x, y, heading; None if there is no
            solution, or its covariance is too large.
        """
        late_rad = self._state.late_rad
        if not self._panorama.add(
            found.pixels_px,
            found.spots.sigmas_px,
            lens=optics.lens,
            joints=joints,
            odometry=odometry,
            late_rad=late_rad,
        ):
            return None
        reach_rad = self._search_rad - _UNSEEN_RAD
        reach_rad += math.atan(optics.lens.centre_px[1] / optics.lens.focal_px[1])
        count = self._config.detection.maximum_spots
        fix = self._solve(spots := self._panorama.frequent_spots(count), optics, reach_rad)
        if fix is None:
            beside = self._panorama.frequent_spots(count, unsure_px=_BESIDE_PX)
            if (beside.sigmas_px > spots.sigmas_px).any():
                fix = self._solve(beside, optics, reach_rad)
        if fix is None:
            return None
        covariance = np.asarray(_PANORAMA_INFLATION * np.linalg.inv(fix.information), np.float64)
        if covariance[0, 0] + covariance[1, 1] > _PANORAMA_SIGMA_M**2:
            return None
        covariance[2, 2] += self._state.covariance[PAN_BIAS, PAN_BIAS] + late_rad**2
        heading = odometry.heading_rad + fix.azimuth_rad - float(self._state.mean[PAN_BIAS])
        return Pose2(x_m=fix.x_m, y_m=fix.y_m, heading_rad=heading), covariance

    def distance2(self, fix: Fix, joints: HeadAngles) -> float:
        """Return the squared Mahalanobis distance of the filter from a fix, 3 dof.

        Their errors are assumed independent; since they share those of the survey, the true
        distance is larger, never smaller.
        """
        mean = self._state.mean
        azimuth = float(mean[HEADING] + mean[PAN_BIAS]) + joints.turret_rad + joints.pan_rad
        turned = angle_difference(azimuth, fix.azimuth_rad)
        difference = np.array([mean[0] - fix.x_m, mean[1] - fix.y_m, turned])
        to_azimuth = np.zeros((3, len(mean)))
        to_azimuth[[0, 1, 2, 2], [0, 1, HEADING, PAN_BIAS]] = 1.0
        if motion := self._state.motion:
            to_azimuth[:, DELAY] = np.negative(motion.pose_rates(float(mean[HEADING])))
        covariance = to_azimuth @ self._state.covariance @ to_azimuth.T
        covariance += np.linalg.inv(fix.information)
        covariance[2, 2] += self._config.noise.pan_tilt_noise_rad**2
        return float(difference @ np.linalg.solve(covariance, difference))

    def _solve(
        self, spots: DirectedSpots, optics: Optics, reach_rad: float | None = None
    ) -> Fix | None:
        """Return the pose and labelling that explain spots, or None."""
        return identify(
            self._geometry(spots.turns_rad, spots.tilts_rad, optics),
            spots.pixels_px,
            spots.sigmas_px,
            arena_size_m=self._arena_size_m,
            config=self._config.association,
            reach_rad=reach_rad,
        )

    def _geometry(
        self, turns_rad: FloatArray, tilts_rad: FloatArray, optics: Optics
    ) -> ImageGeometry:
        state = self._state
        return ImageGeometry(
            leds_m=state.leds_m,
            led_count=len(self._config.landmark_array_m),
            camera_height_m=state.camera_height_m,
            mount_m=state.mount_m,
            level_rad=state.mean[LEVEL:].tolist(),
            turns_rad=turns_rad,
            tilts_rad=tilts_rad + float(state.mean[TILT_BIAS]),
            lens=optics.lens.scaled(state.focal_error),
            nuisance_covariance=state.surveyed_covariance,
            tilt_noise_rad=self._config.noise.pan_tilt_noise_rad,
        )
