"""The pixels of a whole drive as a function of everything that calibration estimates.

| index | unknown, as a difference from what was given | unit | prior (1 sigma) |
| --- | --- | --- | --- |
| 0, 1, 2 | x, y, heading in `map` at the first sample of odometry | m, rad | none |
| 3 ... 8 | camera_mount: x, y, z, roll, pitch, yaw | m, rad | 0.1 |
| 9, 10 | scale of the distances and of the turns of odometry | 1 | 0.1 |
| 11 | drift: turn of the base that odometry lacks | rad/m | 0.1 |
| 12 | delay of the images | s | 0.1 |
| 13 | sideways slip, as in `measurement_model` | s | 0.02 |
| 14 | focal length | 1 | `noise.focal_error` |
| 15 | bias of pan: a yaw before the tilt | rad | `noise.pan_tilt_bias_rad` |
| 16 ... | x, y, z of each LED; of each tag also turns about its axes | m, rad | the survey |
| last | random walk: x, y, heading from knot to knot, in sigmas | 1 | 1 |
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.alignment import moved_on
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.tags import ROTATION_SIGMA_RAD
from goalreach_msgs_py.values import FloatArray, HeadAngles, LandmarkObservation, Pose2
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import MINIMUM_DEPTH_M, Lens, Optics, attitude

POSE: Final = 3
SCALE, TURN, DRIFT, DELAY, SLIP, FOCAL, PAN, LANDMARKS = range(9, 17)
_PRIORS: Final = (*(math.inf,) * POSE, *(0.1,) * 6, 0.1, 0.1, 0.1, 0.1, 0.02)
"""Chosen: what a person with a ruler may get wrong."""
_WALK: Final = (0.001, 0.00035, 0.0005)
"""Least random walk: m and rad per square root of a metre, rad per square root of a radian. Chosen
by the tyres in examples/mujoco_world; with a fifth of it the mount is overconfident."""
_RATE_S: Final = 0.1
"""Half the time over which the rates of joints are measured. Chosen."""
_KNOT_S: Final = 2.0
"""Time from knot to knot of the random walk. Chosen."""
_TINY: Final = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class DriveRecord:
    """What a robot measured on a drive; times in seconds from the first sample of odometry.

    Attributes:
        odometry: (m, 4) of time, x, y, heading.
        joints: (k, 4) of time, turret, pan, tilt.
        stamps_s: (n,) stamps of the images with observations, increasing.
        images: (o,) index of the image of each observation, increasing.
        landmarks: (o,) index of its landmark: LEDs, then corners of tags.
        pixels_px: (o, 2) its pixel, without the distortion of the lens.
        first: Estimated pose in `map` at the first of the stamps.
    """

    odometry: FloatArray
    joints: FloatArray
    stamps_s: FloatArray
    images: NDArray[np.intp]
    landmarks: NDArray[np.intp]
    pixels_px: FloatArray
    camera: PinholeCamera
    first: Pose2

    @classmethod
    def collect(
        cls,
        odometry: Sequence[tuple[float, Pose2]],
        joints: Sequence[tuple[float, HeadAngles]],
        sightings: Sequence[tuple[float, Pose2, Sequence[LandmarkObservation | None]]],
        camera: PinholeCamera,
    ) -> DriveRecord:
        """Return the record of what nodes send, each with its stamp in seconds.

        There are no joints where the camera is fixed. Sightings are estimated poses with
        landmarks, at least one each.
        """
        origin_s, fixed = odometry[0][0], HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
        seen = [
            (image, landmark, (at.u_px, at.v_px))
            for image, (_, _, landmarks) in enumerate(sightings)
            for landmark, at in enumerate(landmarks)
            if at is not None
        ]
        images, landmarks, pixels_px = zip(*seen, strict=True)
        return cls(
            odometry=_table(odometry, origin_s),
            joints=_table(joints or [(origin_s, fixed)], origin_s),
            stamps_s=np.array([at_s - origin_s for at_s, _, _ in sightings]),
            images=np.array(images),
            landmarks=np.array(landmarks),
            pixels_px=Optics(camera).undistort(np.array(pixels_px)),
            camera=camera,
            first=sightings[0][1],
        )


def _table(samples: Sequence[tuple[float, Pose2 | HeadAngles]], origin_s: float) -> FloatArray:
    """Return a row of each time; where one was sent twice, the last counts."""
    rows = dict(samples).items()
    return np.array([(at_s - origin_s, *vars(value).values()) for at_s, value in rows])


class DriveModel:
    """Predicts the observations of a drive.

    Attributes:
        given: (16,) what was given.
        sigmas: (states,) priors.
        groups: The states of each landmark, LEDs before tags.
    """

    def __init__(self, record: DriveRecord, config: LocalizerConfig) -> None:
        self.record, noise = record, config.noise
        self._fx, self._fy, self._cx, self._cy = Lens.of_camera(record.camera).intrinsics
        self._times_s = record.odometry[:, 0]
        self._odometry = np.unwrap(record.odometry[:, 1:], axis=0)
        self._joints = record.joints[:, 0], np.unwrap(record.joints[:, 1:], axis=0)
        leds_m, tags = config.landmark_array_m, config.tag_list
        self._points_m = np.concatenate([leds_m, *(tag.corners_m for tag in tags)])
        effects = [*[np.eye(3)] * len(leds_m), *(tag.corner_effects for tag in tags)]
        rows, columns = np.cumsum([(0, 0), *((e.shape[1], len(e)) for e in effects)], axis=0).T
        self._effects = np.zeros((rows[-1], columns[-1]))
        for effect, row, column in zip(effects, rows.tolist(), columns.tolist(), strict=False):
            self._effects[row : row + effect.shape[1], column : column + len(effect)] = effect.T
        bounds = (LANDMARKS + columns).tolist()
        self.groups = [*map(slice, bounds, bounds[1:])]
        place, turns = [noise.survey_error_m] * 3, [ROTATION_SIGMA_RAD] * 3
        survey = [*place * len(leds_m), *[*place, *turns] * len(tags)]
        self._walk = self._walk_sigmas(config)
        camera = noise.focal_error, noise.pan_tilt_bias_rad
        self.sigmas = np.maximum([*_PRIORS, *camera, *survey, *[1.0] * self._walk.size], _TINY)
        odometry = config.odometry
        errors = odometry.scale - 1.0, odometry.turn_scale - 1.0, odometry.drift_rad_per_m
        start = vars(self._start()).values()
        self.linearize_at(delay_s := config.camera_delay_s)
        self.given = np.array([*start, *config.mount, *errors, delay_s, 0.0, 0.0, 0.0])

    def _start(self) -> Pose2:
        """Return the pose in `map` at the first sample of odometry."""
        stamp_s = self.record.stamps_s[0]
        columns = self._odometry.T
        at = (np.interp(stamp_s, self._times_s, column) for column in columns)
        names = tuple(vars(self.record.first))
        odometry = (dict(zip(names, map(float, row), strict=True)) for row in (at, columns[:, 0]))
        return moved_on(self.record.first, *(Pose2(**values) for values in odometry))

    def _walk_sigmas(self, config: LocalizerConfig) -> FloatArray:
        """Prepare the path; return the sigmas of x, y, heading from knot to knot, (knots, 3)."""
        steps = np.diff(self._odometry, axis=0)
        lengths_m, turns_rad = np.hypot(steps[:, 0], steps[:, 1]), np.abs(steps[:, 2])
        self._driven_m = np.append(0.0, np.cumsum(lengths_m))
        begin_s, end_s = self._times_s[[0, -1]].tolist()
        self._knots_s = np.linspace(begin_s, end_s, 2 + int((end_s - begin_s) / _KNOT_S))
        totals = self._driven_m, np.append(0.0, np.cumsum(turns_rad))
        metres, radians = (np.diff(np.interp(self._knots_s, self._times_s, t)) for t in totals)
        own, walk = config.filter, [sigma**2 for sigma in _WALK]
        place = max(own.slip_m_per_sqrt_m**2, walk[0]) * metres
        heading = max(own.heading_walk_rad_per_sqrt_m**2, walk[1]) * metres
        heading += max(own.heading_walk_rad_per_sqrt_rad**2, walk[2]) * radians
        return np.sqrt(np.stack([place, place, heading], axis=1))

    def path(self, state: FloatArray) -> FloatArray:
        """Return x, y, heading in `map` at each sample of odometry, (m, 3)."""
        x_m, y_m, heading_rad, *_, scale, turn, drift, _, slip, _, _ = state[:LANDMARKS].tolist()
        steps = state[LANDMARKS + self._effects.shape[1] :].reshape(-1, 3) * self._walk
        walk = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
        walked = np.stack([np.interp(self._times_s, self._knots_s, w) for w in walk.T], axis=1)
        read = self._odometry
        turned = (1.0 + turn) * (read[:, 2] - read[0, 2]) + drift * self._driven_m
        heading = heading_rad + turned + walked[:, 2]
        between = 0.5 * np.diff(heading - read[:, 2]) + (heading - read[:, 2])[:-1]
        dx, dy, dtheta = np.diff(read, axis=0).T
        aside = slip * dtheta / np.diff(self._times_s)
        east = np.cos(between) * dx - np.sin(between) * dy
        north = np.sin(between) * dx + np.cos(between) * dy
        moves = np.stack(
            [(1.0 + scale) * east + aside * north, (1.0 + scale) * north - aside * east]
        )
        places = np.concatenate([np.zeros((2, 1)), np.cumsum(moves, axis=1)], axis=1)
        return np.stack(
            [x_m + places[0] + walked[:, 0], y_m + places[1] + walked[:, 1], heading], axis=1
        )

    def linearize_at(self, delay_s: float) -> None:
        """Read the joints at a delay, and their rates from samples that those do not share.

        Between two samples their noise is less than at one, which a fit takes for a better delay.
        """
        times_s, (stamps_s, joints) = self.record.stamps_s - delay_s, self._joints
        at, later, before = (
            np.stack([np.interp(times_s + shift_s, stamps_s, c) for c in joints.T])
            for shift_s in (0.0, _RATE_S, -_RATE_S)
        )
        self._delay_s, self._read, self._rates = delay_s, at, (later - before) / (2.0 * _RATE_S)

    def pixels(
        self, difference: FloatArray, pan_rad: float = 0.0, tilt_rad: float = 0.0
    ) -> FloatArray:
        """Return the pixels of all observations, (o, 2), by the state minus what was given.

        All readings of pan and tilt may be wrong by an angle each.
        """
        state = difference.copy()
        state[:LANDMARKS] += self.given
        times_s = self.record.stamps_s - state[DELAY]
        path = [np.interp(times_s, self._times_s, column) for column in self.path(state).T]
        turret, pan, tilt = self._read - (state[DELAY] - self._delay_s) * self._rates
        pan_rad += state[PAN]
        mount, images = state[POSE:SCALE], self.record.images
        azimuth, tilt = path[2] + turret + pan + pan_rad, tilt + tilt_rad
        ca, sa, ct, st = (f(a)[images] for a in (azimuth, tilt) for f in (np.cos, np.sin))
        landmarks = state[LANDMARKS : LANDMARKS + self._effects.shape[1]]
        points_m = self._points_m + (self._effects @ landmarks).reshape(-1, 3)
        dx, dy, dz = points_m[self.record.landmarks].T
        dx, dy, dz = dx - path[0][images], dy - path[1][images], dz - mount[2]
        level = ca * dx + sa * dy
        offsets_m = np.stack(
            [ct * level + st * dz, ca * dy - sa * dx, ct * dz - st * level], axis=1
        )
        offsets_m[:, :2] -= mount[:2]
        forward, left, up = (offsets_m @ attitude(*mount[3:].tolist())).T
        depth = np.maximum(forward, MINIMUM_DEPTH_M) / (1.0 + state[FOCAL])
        return np.stack(
            [self._cx - self._fx * left / depth, self._cy - self._fy * up / depth], axis=1
        )
