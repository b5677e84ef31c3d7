"""Tags in the images of the simulator: where they are, what hides them, and a drive by them."""

from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray
import pytest

from goalreach_evaluation.drive import InProcessDrive
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy_file import read_policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_msgs_py.obstacles import Obstacle
from goalreach_msgs_py.values import Confidence, FloatArray, HeadAngles, Pose2
from goalreach_perception.measurement_model import Optics
from goalreach_perception.tag_detection import TagDetector
from goalreach_sim.simulator import Simulator
from goalreach_sim.simulator_config import SimulatorConfig
from tag_images import SIX_TAGS, in_camera

ARENA = Arena(landmarks_m=(), tags=SIX_TAGS)
NONE = noise_preset('none')
PLACES = [(0.8, 3.0, -1.57), (2.2, 1.5, -1.2), (1.0, 2.0, -0.1), (2.4, 3.0, 1.5), (1.6, 2.6, 3.0)]


def pose(x_m: float, y_m: float, heading_rad: float) -> Pose2:
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=heading_rad)


def image_from(
    place: Pose2, noise: NoiseModel = NONE, *, seed: int = 0, arena: Arena = ARENA
) -> NDArray[np.uint8]:
    config = SimulatorConfig.for_arena(arena, noise)
    simulator = Simulator(config, np.random.default_rng(seed))
    simulator.reset(place)
    simulator.advance()
    return simulator.sense().image


def corners_px(image: NDArray[np.uint8]) -> dict[int, FloatArray]:
    """Return the corners found, (4, 2), by the number of the tag."""
    optics = Optics(SimulatorConfig().calibrated_camera)
    found = TagDetector(SIX_TAGS, '36h11', 0, 0.0).find(image, optics)
    quads_px = found.pixels_px.reshape(-1, 4, 2)
    return dict(zip((found.leds[::4] // 4).tolist(), quads_px, strict=True))


@pytest.mark.parametrize('place', PLACES)
def test_corners_are_where_they_project(place: tuple[float, float, float]) -> None:
    found = corners_px(image_from(pose(*place)))
    assert found
    for number, quad_px in found.items():
        seen = in_camera(SIX_TAGS[number].corners_m, pose(*place))
        projected_px = SimulatorConfig().calibrated_camera.project(seen)
        assert quad_px == pytest.approx(projected_px, abs=0.05)


def test_a_tag_hangs_about_where_it_was_surveyed() -> None:
    place, noise = pose(0.8, 1.5, -1.57), replace(NONE, survey_error_m=0.003)
    exact_px = corners_px(image_from(place))[0]
    errors_px = [
        (corners_px(image_from(place, noise, seed=seed))[0] - exact_px).mean(axis=0)
        for seed in range(30)
    ]
    # Pixels per metre: the focal length of 554 px over a range of 1.5 m.
    assert np.std(errors_px) == pytest.approx(0.003 * 554.0 / 1.5, rel=0.35)


def test_a_tag_is_not_seen_from_behind_nor_through_a_post() -> None:
    behind = (replace(SIX_TAGS[0], facing_rad=-math.pi / 2),)
    place = pose(0.8, 3.0, -math.pi / 2)
    assert image_from(place, arena=replace(ARENA, tags=behind)).max() == 10
    post = Obstacle(x_m=0.8, y_m=1.5, radius_m=0.2, height_m=2.0)
    arena = replace(ARENA, tags=SIX_TAGS[:1], obstacles=(post,))
    assert image_from(place, arena=arena).max() == 10
    assert image_from(place, arena=replace(arena, obstacles=())).max() > 130


def test_paper_covers_the_wall_behind_it() -> None:
    lit = replace(NONE, ambient_dn=60.0)
    image, (u_px, v_px) = image_from(pose(*PLACES[0]), lit), (320, 203)
    tag = image[v_px - 26 : v_px + 26, u_px - 26 : u_px + 26]
    assert set(np.unique(image[300:])) == {70}
    assert tag.min() < 30  # a tenth of white, on a dark image of 10
    assert tag.max() > 140


def test_a_turning_camera_smears_a_tag_along_its_rows() -> None:
    sharpness = []
    for turn_rad in (0.0, 0.5):
        config = SimulatorConfig.for_arena(ARENA, replace(NONE, exposure_s=0.02))
        simulator = Simulator(config, np.random.default_rng(0))
        simulator.reset(pose(*PLACES[0]))
        simulator.command_head(HeadAngles(turret_rad=0.0, pan_rad=turn_rad, tilt_rad=0.0))
        for _ in range(3):
            simulator.advance()
        image = simulator.sense().image.astype(np.float64)
        sharpness.append([np.abs(np.diff(image, axis=axis)).max() for axis in (0, 1)])
    (_, still), (down, across) = sharpness
    assert across < 0.5 * still
    assert across < 0.5 * down


def test_a_path_by_tags_alone() -> None:
    drive = InProcessDrive(
        arena=ARENA,
        noise=noise_preset('nominal'),
        policy=read_policy('paper'),
        controller=ControllerConfig(),
        seed=np.random.SeedSequence(3),
    )
    frames = list(drive.drive_frames(pose(1.0, 2.6, 2.0)))
    sure = [frame for frame in frames if frame.state.confidence is Confidence.OK]
    errors_m = [
        math.hypot(frame.pose.x_m - frame.true_pose.x_m, frame.pose.y_m - frame.true_pose.y_m)
        for frame in sure
    ]
    assert frames[-1].result is not None
    assert frames[-1].result.outcome == 'goal'
    assert len(sure) > 0.5 * len(frames)
    assert np.percentile(errors_m, 95) < 0.03
