"""Planted errors are found from drives that the model itself, or hand-made geometry, describes."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest
from scipy.stats import chi2

from goalreach_msgs_py.arena import LENGTH_M, WIDTH_M
from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.parameters import build_config, flatten_config
from goalreach_msgs_py.tags import Tag, tags_to_flat
from goalreach_msgs_py.values import FloatArray, HeadAngles, LandmarkObservation, Pose2
from goalreach_perception.calibration import Calibration, calibrate
from goalreach_perception.calibration_model import (
    DELAY,
    DRIFT,
    FOCAL,
    LANDMARKS,
    PAN,
    POSE,
    SCALE,
    TURN,
    DriveModel,
    DriveRecord,
)
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import CameraMount

CAMERA = PinholeCamera.from_field_of_view(horizontal_fov_rad=math.radians(60.0))
EIGHT_LEDS_M = (
    *(0.6, 0.0, 1.45, 1.6, 0.0, 1.3, 2.9, 0.0, 1.5, WIDTH_M, 1.6, 1.35),
    *(WIDTH_M, 3.6, 1.5, 2.3, LENGTH_M, 1.3, 0.8, LENGTH_M, 1.5, 0.0, 2.8, 1.35),
)
PERIOD_S = 0.04
REPORTED = slice(POSE, DELAY + 1)


def square(turn_rad: float = math.pi / 2) -> list[tuple[float, Pose2]]:
    """Return samples of a square of 1 m at 25 Hz: 0.25 m/s ahead, 0.5 rad/s on the spot."""
    x_m, y_m, heading = 1.2, 3.2, -math.pi / 2
    path = [Pose2(x_m=x_m, y_m=y_m, heading_rad=heading)] * 25
    for _ in range(4):
        for _ in range(100):
            x_m, y_m = x_m + 0.01 * math.cos(heading), y_m + 0.01 * math.sin(heading)
            path.append(Pose2(x_m=x_m, y_m=y_m, heading_rad=heading))
        for _ in range(round(abs(turn_rad) / 0.02)):
            heading += math.copysign(0.02, turn_rad)
            path.append(Pose2(x_m=x_m, y_m=y_m, heading_rad=heading))
    path += [path[-1]] * 25
    return [(PERIOD_S * k, pose) for k, pose in enumerate(path)]


def head_at(pose: Pose2, k: int, sweep_rad: float = 0.0) -> HeadAngles:
    """Return a head that keeps to the goal wall, or looks around, and nods."""
    return HeadAngles(
        turret_rad=-math.pi / 2 - pose.heading_rad + sweep_rad * k,
        pan_rad=0.15 * math.sin(0.02 * k),
        tilt_rad=0.15 + 0.1 * math.sin(0.03 * k),
    )


def observe(
    config: LocalizerConfig,
    truth: dict[int, float],
    rng: np.random.Generator,
    *,
    fixed: bool = False,
    path: list[tuple[float, Pose2]] | None = None,
    sweep_rad: float = 0.0,
) -> tuple[DriveRecord, DriveModel]:
    """Return a drive with every fourth image, in which the model has these differences."""
    path = path or square()
    joints = (
        [] if fixed else [(at, head_at(pose, k, sweep_rad)) for k, (at, pose) in enumerate(path)]
    )
    count = len(config.landmark_array_m) + 4 * len(config.tag_list)
    all_seen = [LandmarkObservation(u_px=0.0, v_px=0.0, peak_dn=200.0)] * count
    sightings = [(at, pose, all_seen) for at, pose in path[10:-10:4]]
    record = DriveRecord.collect(path, joints, sightings, CAMERA)
    model = DriveModel(record, config)
    state = np.zeros(len(model.sigmas))
    for index, value in truth.items():
        state[index] = value
    walks = slice(model.groups[-1].stop, None)
    state[walks] = rng.standard_normal(len(state[walks]))
    sigma_rad, images = (0.0 if fixed else config.noise.pan_tilt_noise_rad), record.images
    turns = sigma_rad * rng.standard_normal((2, len(record.stamps_s)))
    model.linearize_at(state[DELAY])
    exact = pixels = model.pixels(state)
    for index, turn in enumerate(((1e-6, 0.0), (0.0, 1e-6))):
        by_turn = (model.pixels(state, *turn) - exact) / 1e-6
        pixels = pixels + by_turn * turns[index][images][:, None]
    pixels = pixels + config.detection.centroid_sigma_px * rng.standard_normal(pixels.shape)
    seen = np.flatnonzero(
        (pixels > 0.0).all(axis=1) & (pixels[:, 0] < 640.0) & (pixels[:, 1] < 480.0)
    )
    kept, images = np.unique(images[seen], return_inverse=True)
    record = replace(
        record,
        stamps_s=record.stamps_s[kept],
        images=images,
        landmarks=record.landmarks[seen],
        pixels_px=pixels[seen],
        first=sightings[kept[0]][1],
    )
    return record, model


def planted(rng: np.random.Generator, config: LocalizerConfig, leds: int) -> dict[int, float]:
    """Return errors of a robot set up without care, and drawn ones of the rest."""
    mount = rng.normal(0.0, (0.03, 0.03, 0.02, 0.02, 0.02, 0.03))
    truth = {POSE + k: float(value) for k, value in enumerate(mount)}
    truth |= {SCALE: 0.03, TURN: 0.02, DRIFT: 0.02, DELAY: 0.06}
    truth[FOCAL] = float(rng.normal(0.0, config.noise.focal_error))
    truth[PAN] = float(rng.normal(0.0, config.noise.pan_tilt_bias_rad))
    survey = rng.normal(0.0, config.noise.survey_error_m, 3 * leds)
    return truth | {LANDMARKS + k: float(value) for k, value in enumerate(survey)}


def errors(found: Calibration, truth: dict[int, float]) -> FloatArray:
    """Return estimates minus truth of the ten numbers before the survey."""
    return np.array(
        [one.value - one.given - truth.get(POSE + k, 0.0) for k, one in enumerate(found.values)]
    )[:10]


def test_planted_errors_are_found_within_their_sigmas() -> None:
    config, sigmas, nees = LocalizerConfig(), [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        truth = planted(rng, config, 3)
        found = calibrate(observe(config, truth, rng)[0], config)
        off = errors(found, truth)
        sigmas.append(off / [one.sigma for one in found.values[:10]])
        nees.append(off @ np.linalg.solve(found.covariance[:10, :10], off))
        assert (found.misfits, found.usable) == ((), True)
        assert found.residual_px == pytest.approx(found.expected_px, rel=0.2)
    assert np.mean(np.abs(sigmas) < 3.0) > 0.97
    assert np.mean(np.all(np.abs(sigmas) < 3.0, axis=1)) >= 0.95
    assert chi2.ppf(0.001, 200) < np.sum(nees) < chi2.ppf(0.999, 200)


def test_a_wrong_survey_is_traced_to_its_led() -> None:
    config = replace(LocalizerConfig(), landmarks_m=EIGHT_LEDS_M)
    truth = {LANDMARKS + 3: 0.02, POSE: 0.05}
    record, _ = observe(config, truth, np.random.default_rng(1), sweep_rad=0.015)
    found = calibrate(record, config)
    (line,) = found.misfits
    assert line.startswith('the survey of LED 1 is off by 0.0')
    (x,) = (one for one in found.values if one.name == 'landmarks_m LED 1 x')
    assert x.value - x.given == pytest.approx(0.02, abs=3.0 * x.sigma)
    assert x.sigma < 0.006


def test_three_leds_do_not_tell_which_of_them_is_wrong() -> None:
    config = LocalizerConfig()
    record, _ = observe(config, {LANDMARKS + 3: 0.04}, np.random.default_rng(2))
    found = calibrate(record, config)
    assert len(found.misfits) > 1
    assert all('or another one in its place' in line for line in found.misfits)
    (x,) = (one for one in found.values if one.name == 'landmarks_m LED 1 x')
    assert abs(x.value - x.given - 0.04) < 3.0 * x.sigma
    assert found.parameters['noise.survey_error_m'] > 0.01


def test_what_a_drive_does_not_tell_is_left_as_given() -> None:
    standing = [
        (PERIOD_S * k, Pose2(x_m=1.778, y_m=3.0, heading_rad=-math.pi / 2)) for k in range(200)
    ]
    mount = (0.02, 0.0, 1.1, 0.0, 0.0, 0.1)
    config = replace(LocalizerConfig(), camera_mount=mount)
    rng = np.random.default_rng(3)
    record, _ = observe(config, {}, rng, fixed=True, path=standing)
    found = calibrate(record, replace(config, camera_delay_s=0.02))
    unseen = {one.name: one for one in found.values if not one.observed}
    assert {'camera_mount x', 'camera_mount yaw', 'odometry.scale', 'camera_delay_s'} <= set(
        unseen
    )
    assert unseen['camera_mount yaw'].value == 0.1
    assert found.parameters['camera_delay_s'] == 0.02
    assert found.parameters['odometry.scale'] == 1.0


def test_a_fixed_camera_tells_its_mount_where_the_robot_turns() -> None:
    config = replace(LocalizerConfig(), landmarks_m=EIGHT_LEDS_M)
    rng = np.random.default_rng(4)
    truth = {POSE: 0.05, POSE + 1: -0.02, POSE + 5: 0.03, DELAY: 0.06, SCALE: 0.03}
    record, _ = observe(config, truth, rng, fixed=True)
    found = calibrate(record, config)
    assert all(one.observed for one in found.values[:10])
    assert np.all(np.abs(errors(found, truth)) < [4.0 * one.sigma for one in found.values[:10]])


def test_images_of_other_lights_do_not_count() -> None:
    config, truth = LocalizerConfig(), {POSE: 0.05, SCALE: 0.03}
    record, _ = observe(config, truth, np.random.default_rng(5))
    pixels = record.pixels_px.copy()
    pixels[record.images % 7 == 0] += 60.0
    found = calibrate(replace(record, pixels_px=pixels), config)
    assert np.all(np.abs(errors(found, truth)) < [4.0 * one.sigma for one in found.values[:10]])
    assert any(line.startswith('15% of the images do not fit') for line in found.misfits)


def test_tags_move_as_a_whole() -> None:
    tags = [
        Tag(id=k, size_m=0.2, x_m=x, y_m=0.0, z_m=1.3 + 0.1 * k, facing_rad=math.pi / 2)
        for k, x in enumerate((0.6, 1.8, 2.9))
    ]
    config = replace(LocalizerConfig(), leds=False, tags=tags_to_flat(tags))
    turned = {LANDMARKS + 4: 0.02, LANDMARKS: 0.003}
    record, model = observe(config, turned, np.random.default_rng(6))
    moved = replace(tags[0], x_m=0.603, facing_rad=math.pi / 2 + 0.02)
    same = DriveModel(record, replace(config, tags=tags_to_flat([moved, *tags[1:]])))
    state = np.zeros(len(model.sigmas))
    state[[LANDMARKS, LANDMARKS + 4]] = 0.003, 0.02
    seen = DriveModel(record, config).pixels(state)
    assert same.pixels(np.zeros(len(state))) == pytest.approx(seen, abs=0.05)
    found = calibrate(record, config)
    (facing,) = (one for one in found.values if one.name == 'tags tag 0 facing')
    assert facing.value - facing.given == pytest.approx(0.02, abs=3.0 * facing.sigma)
    assert len(found.parameters['tags']) == len(tags_to_flat(tags))


def test_the_parameters_are_those_of_the_localizer() -> None:
    config = LocalizerConfig()
    record, _ = observe(config, {POSE: 0.05}, np.random.default_rng(7))
    found = calibrate(record, config).parameters
    assert set(found) - {'camera_delay_s'} <= set(flatten_config(config))
    built = build_config(LocalizerConfig, {**flatten_config(config), **found})
    assert built.mount[0] == pytest.approx(0.05, abs=0.01)


@pytest.mark.parametrize(
    'mount', [(0.05, -0.02, 1.2, 0.02, 0.0, 0.0), (0.0, 0.0, 1.1, 0.1, 0.05, 0.2)]
)
def test_pixels_are_those_of_the_camera_mount(
    mount: tuple[float, float, float, float, float, float],
) -> None:
    config = replace(LocalizerConfig(), camera_mount=mount, noise=NoiseModel())
    record, model = observe(config, {}, np.random.default_rng(8))
    pixels = DriveModel(record, config).pixels(np.zeros(len(model.sigmas)))
    path = square()
    for row in range(0, len(pixels), 50):
        k = round(record.stamps_s[record.images[row]] / PERIOD_S)
        led_m = config.landmark_array_m[record.landmarks[row]][None]
        seen = CameraMount(mount).points_in_camera(led_m, path[k][1], head_at(path[k][1], k))
        assert pixels[row] == pytest.approx(CAMERA.project(seen)[0], abs=1e-3)
