from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray
import pytest

from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.association import Fix
from goalreach_perception.measurement_model import FOCAL, HEIGHT, LEDS, TILT_BIAS
from goalreach_perception.misfit import ConstantsWatch, FixWatch, InnovationWatch

HERE = Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0)


def test_consistent_innovations_let_nothing_grow() -> None:
    watch = InnovationWatch()
    assert [watch.add(6.0, 6) for _ in range(200)] == [1.0] * 200
    assert watch.add(1e6, 6) == 1.0  # one outlier: it counts as 36, beside 150 degrees of freedom
    assert watch.add(1e6, 6) == pytest.approx((180.0 * 0.96 + 36.0) / 150.0, rel=1e-3)


def test_innovations_beyond_their_covariance_let_it_grow_by_their_average() -> None:
    watch = InnovationWatch()
    growth = [watch.add(24.0, 6) for _ in range(6)]
    assert growth[:5] == [1.0] * 5
    assert growth[5] == pytest.approx(4.0)
    assert watch.add(24.0, 6) == 1.0  # the next second begins


def test_chance_lets_nothing_grow_however_few_leds_an_image_shows() -> None:
    rng = np.random.default_rng(0)
    for freedom in (2, 6):
        watch = InnovationWatch()
        grown = [watch.add(distance2, freedom) for distance2 in rng.chisquare(freedom, 20_000)]
        assert sum(growth > 1.0 for growth in grown) <= 1  # of 800 independent seconds


def _joints(turret_rad: float, pan_rad: float) -> HeadAngles:
    return HeadAngles(turret_rad=turret_rad, pan_rad=pan_rad, tilt_rad=0.2)


def _fix(azimuth_rad: float, x_m: float = 1.0) -> Fix:
    none: NDArray[np.intp] = np.empty(0, np.intp)
    return Fix(
        x_m=x_m,
        y_m=2.0,
        azimuth_rad=azimuth_rad,
        chi2=0.0,
        information=np.eye(3),
        spots=none,
        leds=none,
    )


@pytest.mark.parametrize(('joint', 'signs'), [('pan', (1, -1)), ('turret', (-1, 1)), ('', (1, 1))])
def test_a_joint_of_wrong_sign_is_named(joint: str, signs: tuple[int, int]) -> None:
    watch = FixWatch()
    for turret, pan in ((0.0, 0.0), (0.7, 0.3), (0.2, -0.8), (-0.4, 0.9)):
        azimuth = math.remainder(2.0 + signs[0] * turret + signs[1] * pan, math.tau)
        watch.add_fix(_fix(azimuth), HERE, _joints(turret, pan))
    assert f'the sign of {joint}_joint' in watch.reason if joint else not watch.reason


def test_lights_that_no_pose_explains_are_reported_until_one_does() -> None:
    watch = FixWatch()
    for _ in range(24):
        watch.add_unsolved(3)
    assert not watch.reason
    watch.add_unsolved(4)
    assert 'landmarks_m' in watch.reason
    watch.add_fix(_fix(1.0), HERE, _joints(0.0, 0.0))
    for _ in range(100):
        assert not watch.reason
        watch.add_unsolved(2)
    assert watch.reason


def test_a_search_that_sees_no_two_leds_is_reported_but_refuses_no_pose() -> None:
    watch = FixWatch()
    for lights in [0, 1] * 250:
        assert not watch.advice
        watch.add_unsolved(lights)
    assert 'the sign of tilt_joint' in watch.advice
    watch.add_unsolved(2)
    assert not watch.advice


def _watched(coordinates: int) -> tuple[ConstantsWatch, FloatArray, FloatArray]:
    size = LEDS + coordinates + 3
    return (
        ConstantsWatch(np.zeros(size), np.ones(size), slice(LEDS, LEDS + coordinates)),
        np.zeros(size),
        np.diag(np.full(size, 0.8)),
    )


@pytest.mark.parametrize(('coordinates', 'limit'), [(9, 3.5), (72, 4.02)])
def test_the_limit_of_a_survey_grows_with_the_number_of_coordinates(
    coordinates: int, limit: float
) -> None:
    watch, mean, covariance = _watched(coordinates)
    for excess, suspect in ((limit - 0.02, 0), (limit + 0.02, LEDS + 4)):
        mean[LEDS + 4] = -excess
        watch.update(mean, covariance)
        assert watch.suspect == suspect


def test_a_landmark_is_suspected_before_other_constants() -> None:
    watch, mean, covariance = _watched(9)
    mean[FOCAL] = 4.1
    watch.update(mean, covariance)
    assert watch.suspect == FOCAL
    mean[:3] = 9.0  # a pose is no constant
    mean[LEDS] = 3.6
    watch.update(mean, covariance)
    assert watch.suspect == LEDS
    mean[LEDS] = 3.0
    watch.update(mean, covariance)
    assert watch.suspect == LEDS


def test_constants_that_explain_an_error_together_are_suspect_together() -> None:
    watch, mean, covariance = _watched(9)
    states = [TILT_BIAS, HEIGHT, FOCAL]
    covariance[states, states] = 0.1
    mean[states] = -2.5, 3.0, 2.4
    watch.update(mean, covariance)
    assert watch.suspect == HEIGHT
    watch.suspect = 0
    mean[TILT_BIAS] = 0.0
    watch.update(mean, covariance)
    assert watch.suspect == 0


def test_a_suspect_is_cleared_by_evidence_not_by_forgetting() -> None:
    watch, mean, covariance = _watched(9)
    mean[LEDS + 1] = 5.0
    watch.update(mean, covariance)
    mean[LEDS + 1], covariance[LEDS + 1, LEDS + 1] = 0.0, 1.0
    watch.update(mean, covariance)
    assert watch.suspect == LEDS + 1
    mean[LEDS + 1], covariance[LEDS + 1, LEDS + 1] = 2.0, 0.8
    watch.update(mean, covariance)
    assert watch.suspect == 0


def test_another_constant_is_cleared_by_evidence_too() -> None:
    watch, mean, covariance = _watched(9)
    for focal, variance, suspect in ((5.0, 0.8, FOCAL), (0.0, 1.0, FOCAL), (0.0, 0.8, 0)):
        mean[FOCAL], covariance[FOCAL, FOCAL] = focal, variance
        watch.update(mean, covariance)
        assert watch.suspect == suspect


@pytest.mark.parametrize(
    ('signs', 'late_rad', 'named'),
    [((-1, -1), 0.0, True), ((-1, -1), 0.03, False), ((-1, 1, -1), 0.0, False)],
)
def test_a_joint_is_named_by_two_turns_that_contradict_it(
    signs: tuple[int, ...], late_rad: float, *, named: bool
) -> None:
    watch, azimuth = FixWatch(), 0.0
    for number, sign in enumerate((1, *signs)):
        azimuth += 0.3 + 0.4 * sign
        joints = _joints(0.3 * number, 0.4 * number)
        watch.add_fix(_fix(azimuth), HERE, joints, late_rad * number)
    assert bool(watch.reason) == named


@pytest.mark.parametrize(('driven_m', 'named'), [(0.0, False), (0.9, True), (1.0, True)])
def test_a_robot_that_was_carried_tells_nothing_of_its_joints(
    driven_m: float, *, named: bool
) -> None:
    watch = FixWatch()
    for number in range(3):
        fix = _fix(-0.4 * number, 1.0 + number)
        came = replace(HERE, y_m=driven_m * number)
        watch.add_fix(fix, came, _joints(0.0, 0.4 * number))
    assert bool(watch.reason) == named
