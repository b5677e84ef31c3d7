"""Tags in rendered images: corners, the pose of one image against its bound, and a drive."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import math

import cv2
import numpy as np
import pytest

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.tags import Tag, tags_to_flat
from goalreach_msgs_py.values import FloatArray, HeadAngles, Odometry, Pose2, Twist2
from goalreach_perception.association import AssociationConfig, Fix, identify_labelled
from goalreach_perception.detection import Spots
from goalreach_perception.landmark_tracking import MatchedLeds, correct_by
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import LEDS, Lens, Optics
from goalreach_perception.one_image_pose import ImageGeometry
from goalreach_perception.pose_filter import PoseFilter
from goalreach_perception.process_model import FilterConfig
from goalreach_perception.tag_detection import TagDetector, outside
from tag_images import CAMERA, EYE_M, SIX_TAGS, in_camera, tag_image

ARENA_M = (3.556, 5.08)
FIXED = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
CORNERS_M = np.concatenate([tag.corners_m for tag in SIX_TAGS])
VIEWS = [(1.75, 3.2, -1.57), (2.2, 3.0, -1.5), (1.0, 2.6, -0.2), (1.6, 2.2, 1.5), (1.3, 3.4, -1.4)]


def pose_of(view: tuple[float, float, float]) -> Pose2:
    x_m, y_m, heading_rad = view
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)


def true_pixels(pose: Pose2, camera: PinholeCamera = CAMERA) -> FloatArray:
    return camera.project(in_camera(CORNERS_M, pose))


def detector(sigma_px: float = 0.025) -> TagDetector:
    return TagDetector(SIX_TAGS, '36h11', 0, sigma_px)


@pytest.mark.parametrize(('blur_px', 'noise_dn'), [(0.5, 1.0), (0.9, 4.0), (1.3, 8.0)])
def test_corners_err_by_what_their_sigmas_say(blur_px: float, noise_dn: float) -> None:
    rng, errors, sigmas = np.random.default_rng(1), [], []
    for view in VIEWS:
        image = tag_image(SIX_TAGS, pose_of(view), rng, blur_px=blur_px, noise_dn=noise_dn)
        found = detector(0.01).find(image, Optics(CAMERA))
        errors += (found.pixels_px - true_pixels(pose_of(view))[found.leds]).tolist()
        sigmas += found.spots.sigmas_px.tolist()
    assert len(sigmas) >= 20
    relative = np.array(errors) / np.array(sigmas)[:, None]
    assert 0.3 < np.mean(relative**2) < 1.6
    assert np.abs(errors).max() < 0.15


def test_distortion_is_removed_before_tags_are_measured() -> None:
    terms = (-0.12, 0.02, 0.0, 0.0, 0.0)
    camera, pose = replace(CAMERA, distortion=terms), Pose2(x_m=1.6, y_m=2.4, heading_rad=-1.9)
    ideal = np.indices((640, 480)).reshape(2, -1).T.astype(np.float64)
    optics = Optics(camera)
    sharp = tag_image(SIX_TAGS, pose, np.random.default_rng(2), noise_dn=0.0)
    maps = [part.reshape(640, 480).T.astype(np.float32) for part in optics.undistort(ideal).T]
    u, v = (np.ascontiguousarray(part) for part in maps)
    bent = np.asarray(cv2.remap(sharp, u, v, cv2.INTER_CUBIC), np.uint8)
    found = detector().find(bent, optics)
    assert len(found.leds) >= 4
    assert found.pixels_px == pytest.approx(true_pixels(pose)[found.leds], abs=0.12)
    assert found.spots.pixels_px == pytest.approx(true_pixels(pose, camera)[found.leds], abs=0.12)


def fix_of(found: MatchedLeds, sigmas_px: FloatArray, seed: Pose2) -> Fix | None:
    """Return the pose by corners whose places are known exactly."""
    size = LEDS + CORNERS_M.size
    return identify_labelled(
        ImageGeometry(
            leds_m=CORNERS_M,
            led_count=0,
            camera_height_m=EYE_M,
            turns_rad=np.zeros(len(found.leds)),
            tilts_rad=np.zeros(len(found.leds)),
            lens=Lens.of_camera(CAMERA),
            nuisance_covariance=np.zeros((size + 5, size + 5)),
            tilt_noise_rad=0.0,
        ),
        found.pixels_px,
        sigmas_px,
        found.leds,
        seeds=np.array([[seed.x_m, seed.y_m, seed.heading_rad]]),
        arena_size_m=ARENA_M,
        config=AssociationConfig(),
    )


def repeated(view: tuple[float, float, float], count: int, noise_dn: float) -> list[MatchedLeds]:
    """Return the corners of images that differ by their noise alone."""
    rng, optics = np.random.default_rng(3), Optics(CAMERA)
    clean = tag_image(SIX_TAGS, pose_of(view), rng, noise_dn=0.0)
    noisy = (clean + rng.normal(0.0, noise_dn, clean.shape) for _ in range(count))
    return [
        detector(0.0).find(np.clip(one.round(), 0, 255).astype(np.uint8), optics) for one in noisy
    ]


def test_the_pose_of_one_image_attains_the_bound_of_its_corners() -> None:
    squares_m2, bounds_m2, nees = 0.0, 0.0, []
    for view in VIEWS:
        images, pose = repeated(view, 40, noise_dn=6.0), pose_of(view)
        truth = true_pixels(pose)
        errors_px = np.array([found.pixels_px - truth[found.leds] for found in images])
        sigmas_px = np.sqrt((errors_px**2).mean(axis=(0, 2)))
        for found in images:
            fix = fix_of(found, sigmas_px, pose)
            own = fix_of(found, found.spots.sigmas_px, pose)
            assert fix is not None
            assert own is not None
            bounds_m2 += np.linalg.inv(fix.information)[:2, :2].trace()
            squares_m2 += (own.x_m - pose.x_m) ** 2 + (own.y_m - pose.y_m) ** 2
            error = np.array([own.x_m, own.y_m, own.azimuth_rad]) - np.array(view)
            nees.append(error @ own.information @ error)
    assert 0.8 < math.sqrt(squares_m2 / bounds_m2) < 1.1
    assert 2.0 < np.mean(nees) < 4.0


def test_a_wrong_corner_leaves_out_its_whole_tag() -> None:
    state = PoseFilter(
        FilterConfig(),
        noise_preset('nominal'),
        leds_m=np.empty((0, 3)),
        camera_height_m=EYE_M,
        calibrate=True,
        tags=SIX_TAGS,
    )
    pose = pose_of(VIEWS[0])
    image = tag_image(SIX_TAGS, pose, np.random.default_rng(4))
    found = detector().find(image, Optics(CAMERA))
    moved_px = found.pixels_px.copy()
    moved_px[1] += 3.0
    found = found._replace(pixels_px=moved_px)
    assert len(found.leds) == 8
    state.start(pose, np.diag([1e-4, 1e-4, 1e-4]))
    prediction = state.predict_leds(Lens.of_camera(CAMERA), FIXED)
    assert correct_by(state, prediction, found.select([0, 1, 2, 3]), 0) is None
    used = correct_by(state, prediction, found, 0)
    assert used is not None
    assert used.leds.tolist() == found.leds[4:].tolist()


def drive(
    localizer: LandmarkLocalizer, tags: tuple[Tag, ...], rng: np.random.Generator, turn: float
) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Drive a circle; yield mode, error and covariance of each image."""
    x_m, y_m, heading, start = 1.8, 2.5, turn, np.exp(1j * turn)
    for index in range(50):
        heading += 0.03
        x_m, y_m = x_m + 0.012 * math.cos(heading), y_m + 0.012 * math.sin(heading)
        moved = complex(x_m - 1.8, y_m - 2.5) / start
        odometry = Pose2(x_m=moved.real, y_m=moved.imag, heading_rad=heading - turn)
        pose = Pose2(x_m=x_m, y_m=y_m, heading_rad=heading)
        output = localizer.process(
            time_ns=40_000_000 * index + 1,
            image=tag_image(tags, pose, rng, noise_dn=4.0),
            camera=CAMERA,
            joints=FIXED,
            odometry=Odometry(
                pose=odometry, twist=Twist2(linear_m_per_s=0.3, steering_rad_per_s=0.75)
            ),
        )
        found = output.estimate.pose
        wrong = math.remainder(found.heading_rad - heading, math.tau)
        error = np.array([found.x_m - x_m, found.y_m - y_m, wrong])
        yield output.mode, error, output.estimate.covariance


def test_a_fixed_camera_follows_tags_that_hang_a_little_wrong() -> None:
    rng, noise, nees = np.random.default_rng(5), noise_preset('nominal'), []
    for turn in (0.0, 3.0):
        config = LocalizerConfig(leds=False, tags=tags_to_flat(SIX_TAGS), noise=noise)
        moves = rng.normal(0.0, [noise.survey_error_m] * 3 + [0.01], (len(SIX_TAGS), 4))
        hung = tuple(
            replace(
                tag,
                x_m=tag.x_m + x,
                y_m=tag.y_m + y,
                z_m=tag.z_m + z,
                facing_rad=tag.facing_rad + a,
            )
            for tag, (x, y, z, a) in zip(SIX_TAGS, moves, strict=True)
        )
        for mode, error, covariance in drive(LandmarkLocalizer(config, ()), hung, rng, turn):
            if mode == 'tracking':
                assert math.hypot(*error[:2]) < 0.1
                nees.append(error @ np.linalg.solve(covariance, error))
    assert len(nees) > 70
    assert 0.2 < np.mean(nees) < 4.0


def test_leds_and_tags_are_used_together() -> None:
    rng, pose = np.random.default_rng(6), Pose2(x_m=1.75, y_m=3.2, heading_rad=-1.57)
    leds_m = np.array([(1.2, 0.0, 1.6), (1.8, 0.0, 1.5), (2.2, 0.0, 1.7)])
    leds = tuple(leds_m.reshape(-1).tolist())
    config = LocalizerConfig(landmarks_m=leds, tags=tags_to_flat(SIX_TAGS))
    localizer, twist = (
        LandmarkLocalizer(config, ()),
        Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0),
    )
    v, u = np.indices((480, 640))
    for index in range(4):
        light = tag_image(SIX_TAGS, pose, rng).astype(np.float64)
        for u_px, v_px in CAMERA.project(in_camera(leds_m, pose)):
            light += 120 * np.exp(-((u - u_px) ** 2 + (v - v_px) ** 2) / 2.88)
        output = localizer.process(
            time_ns=40_000_000 * index + 1,
            image=light.clip(0, 255).astype(np.uint8),
            camera=CAMERA,
            joints=FIXED,
            odometry=Odometry(pose=pose, twist=twist),
        )
    assert output.mode == 'tracking'
    seen = [index for index, one in enumerate(output.landmarks) if one is not None]
    assert seen == [*range(3 + 8)]


def test_a_tag_elsewhere_than_the_arena_says_loses_no_pose_silently() -> None:
    rng, config = (
        np.random.default_rng(7),
        LocalizerConfig(leds=False, tags=tags_to_flat(SIX_TAGS)),
    )
    wrong = tuple(replace(tag, x_m=tag.x_m + 0.3 * (tag.id == 1)) for tag in SIX_TAGS)
    localizer, twist = (
        LandmarkLocalizer(config, ()),
        Twist2(linear_m_per_s=0.0, steering_rad_per_s=0.0),
    )
    pose = Pose2(x_m=1.75, y_m=3.2, heading_rad=-1.57)
    modes = {
        localizer.process(
            time_ns=40_000_000 * index + 1,
            image=tag_image(wrong, pose, rng),
            camera=CAMERA,
            joints=FIXED,
            odometry=Odometry(pose=pose, twist=twist),
        ).mode
        for index in range(8)
    }
    assert modes == {'searching'}


def test_spots_in_the_circle_around_a_tag_are_parts_of_it() -> None:
    quad_px = np.array([[80.0, 80.0], [120.0, 80.0], [120.0, 120.0], [80.0, 120.0]])
    tag = MatchedLeds(np.arange(4), Spots.unknown(4)._replace(pixels_px=quad_px), quad_px, 4)
    spots = Spots.unknown(3)._replace(pixels_px=np.array([[135.0, 100], [136.0, 100], [100, 64]]))
    # 1.25 times half the diagonal of 56.6 px.
    assert outside(spots, tag).pixels_px.tolist() == [[136.0, 100.0], [100.0, 64.0]]
