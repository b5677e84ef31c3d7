"""Notices that the model does not fit: innovations beyond their covariance, joints of wrong sign.

The normalized innovations squared of consistent images average at most one for each degree of
freedom. Where they average more over a second, the covariance grows by that factor, priors of all
constants included, until they fit (a fading-memory filter that fades only when it must: Xia et
al., "Adaptive fading Kalman filter with an application", Automatica 1994).
"""

import math
from statistics import NormalDist
from typing import Final

import numpy as np

from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.association import Fix
from goalreach_perception.measurement_model import HEADING
from goalreach_perception.measurement_prediction import equivalent_gate

_KEEP = 0.96
"""Weight of the images before, from one image to the next: 25 images count. Chosen."""
_LEAST_FREEDOM = 30.0
_LARGEST_PER_FREEDOM = 6.0
"""A single image counts at most this much: it may have been an outlier. Chosen."""
_MISFIT, _MISFIT_SIGMAS = 1.3, 4.0
"""Largest average that fits, and the deviation of chance from one, if that is more: images of few
LEDs average less well. Chosen: nominal drives average 0.5, at most 1.2 in 7 minutes; standing with
one LED in view they average 1."""
_SUSPECT_SIGMAS, _COORDINATES = 3.5, 9
"""One of the coordinates of three LEDs so many standard deviations from what was given does not
fit, nor do other constants as unlikely. Chosen: one of 400 drives with the presets of noise has
such a coordinate."""
_CLEARED = 0.75
"""A suspect is cleared within this part of the limit, once images have told as much of it as when
it was found. Chosen."""
_NORMAL: Final = NormalDist()
_TINY = 1e-12
_WEIGHTS = (0, 0, 1, 4)
_UNSOLVED, _UNLIT = 100, 500
"""Unsolved images until the user is told, weighted for no, one, two and more lights; and images of
no light or one. Chosen: a head that turns finds LEDs in 3 s, or 75 images."""
_DISAGREES_RAD, _AGREES_RAD = 0.15, 0.05
_LATE_RAD = 0.02
_VOTES = 2
_CARRIED_M = 0.2
"""Largest difference of two distances of a robot that was not carried. Chosen: ten times the error
of a fix."""
_ADVICE = (
    'no two LEDs are seen in any direction: check the sign of tilt_joint, the LEDs, the exposure '
    'of the camera and the image'
)


class InnovationWatch:
    """Compares innovations with their covariance."""

    def __init__(self) -> None:
        self._sum = self._freedom = self._squares = 0.0

    def add(self, distance2: float, freedom: int) -> float:
        """Add the innovation of an image; return by how much the covariance must grow, or one."""
        self._sum = _KEEP * self._sum + min(distance2, _LARGEST_PER_FREEDOM * freedom)
        self._freedom = _KEEP * self._freedom + freedom
        self._squares = _KEEP**2 * self._squares + freedom
        average, alike = self._sum / self._freedom, self._freedom**2 / self._squares
        limit = max(_MISFIT, equivalent_gate(_MISFIT_SIGMAS**2, 1, alike) / alike)
        if self._freedom < _LEAST_FREEDOM or average <= limit:
            return 1.0
        self._sum = self._freedom = self._squares = 0.0
        return average


class ConstantsWatch:
    """Finds the constant whose estimate is too far from what was given, an LED above all.

    Coordinates of LEDs and tags, the states `places`, are looked at one by one; the limit grows
    with their number, so that chance exceeds it as rarely as with three LEDs (Bonferroni's
    inequality: Dunn, "Multiple comparisons among means", JASA 1961). The other constants explain
    an error together: the sum of their squared deviations is compared with chi-square, of as many
    degrees of freedom as images have told of them.

    Attributes:
        suspect: Index of the constant; 0 for none.
    """

    def __init__(self, given: FloatArray, sigmas: FloatArray, places: slice) -> None:
        self._given, self._sigmas, self._places = given.copy(), np.maximum(sigmas, _TINY), places
        beyond = (1.0 - _NORMAL.cdf(_SUSPECT_SIGMAS)) * _COORDINATES
        self._limit = _NORMAL.inv_cdf(1.0 - beyond / (places.stop - places.start))
        others = sigmas > 0.0
        others[: HEADING + 1] = others[places] = False
        self._others = np.flatnonzero(others)
        self.suspect, self._told = 0, 0.0

    @property
    def is_place(self) -> bool:
        """Whether the suspect is a coordinate of an LED or a tag."""
        return self.suspect in range(self._places.start, self._places.stop)

    def update(self, mean: FloatArray, covariance: FloatArray) -> None:
        """Look for a suspect, or clear it once images tell that it is near what was given."""
        deviations = np.abs(mean - self._given) / self._sigmas
        told = 1.0 - covariance.diagonal() / self._sigmas**2
        places, others = deviations[self._places] / self._limit, deviations[self._others]
        known = float(np.maximum(told[self._others], 0.0).sum())
        excess = (others.dot(others) / equivalent_gate(_SUSPECT_SIGMAS**2, 1, known)) ** 0.5
        if places.max() > 1.0:
            self.suspect = self._places.start + int(places.argmax())
            self._told = told[self.suspect]
        elif not self.is_place:
            if excess > 1.0:
                self.suspect, self._told = int(self._others[others.argmax()]), known
            elif excess < _CLEARED and known >= self._told:
                self.suspect = 0
        elif (
            deviations[self.suspect] < _CLEARED * self._limit and told[self.suspect] >= self._told
        ):
            self.suspect = 0


class FixWatch:
    """Finds joints of wrong sign from poses of single images, and lights that no pose explains."""

    def __init__(self) -> None:
        self._last: tuple[Fix, Pose2, HeadAngles, float] | None = None
        self._votes = {'turret': 0, 'pan': 0}
        self._unsolved = self._unlit = 0

    @property
    def advice(self) -> str:
        """What to check where no lights are found; no reason to refuse a pose."""
        return _ADVICE if self._unlit >= _UNLIT else ''

    @property
    def reason(self) -> str:
        """What does not fit and what to check; empty if nothing is known."""
        for joint, votes in self._votes.items():
            if votes >= _VOTES:
                return (
                    f'the {joint} joint turns against its reading: check the sign of {joint}_joint'
                )
        if self._unsolved >= _UNSOLVED:
            return (
                'no pose explains the lights seen: check the sign of tilt_joint, landmarks_m, '
                'camera_mount and camera_info'
            )
        return ''

    def add_unsolved(self, lights: int) -> None:
        """Count an image whose lights no pose explains."""
        self._unsolved += _WEIGHTS[min(lights, len(_WEIGHTS) - 1)]
        self._unlit = self._unlit + 1 if lights <= 1 else 0

    def add_solved(self) -> None:
        """Count an image whose lights a pose explains."""
        self._unsolved = self._unlit = 0

    def add_fix(
        self, fix: Fix, odometry: Pose2, joints: HeadAngles, late_rad: float = 0.0
    ) -> None:
        """Compare the camera's turn from one fix to the next with that of the joints.

        Only fixes of the same `late_rad` are compared, which is how far the camera turns in the
        time by which the image may be late; and only those as far apart as the odometry says: a
        robot that was carried has been turned, too.
        """
        self.add_solved()
        last, self._last = self._last, (fix, odometry, joints, late_rad)
        if last is None or abs(last[3] - late_rad) >= _LATE_RAD:
            return
        fix_before, odometry_before, before, _ = last
        moved_m = math.hypot(fix.x_m - fix_before.x_m, fix.y_m - fix_before.y_m)
        driven_m = math.hypot(
            odometry.x_m - odometry_before.x_m, odometry.y_m - odometry_before.y_m
        )
        if abs(moved_m - driven_m) > _CARRIED_M:
            return
        turn = fix.azimuth_rad - fix_before.azimuth_rad
        turn -= odometry.heading_rad - odometry_before.heading_rad
        turret, pan = joints.turret_rad - before.turret_rad, joints.pan_rad - before.pan_rad
        rest = wrap_angle(turn - turret - pan)
        turns = {'turret': turret, 'pan': pan}
        if abs(rest) < _AGREES_RAD < abs(turret) and abs(pan) > _AGREES_RAD:
            self._votes = dict.fromkeys(turns, 0)
        fits = [j for j, turn in turns.items() if abs(wrap_angle(rest + 2 * turn)) < _AGREES_RAD]
        if abs(rest) > _DISAGREES_RAD and len(fits) == 1:
            self._votes[fits[0]] += 1
