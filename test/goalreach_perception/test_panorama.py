from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.values import HeadAngles, Pose2
from goalreach_perception.acquisition import Acquisition, Panorama
from goalreach_perception.association import Fix
from goalreach_perception.detection import Spots
from goalreach_perception.landmark_tracking import MatchedLeds
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.measurement_model import PAN_BIAS, CameraMount, Lens, Optics
from goalreach_perception.pose_filter import PoseFilter

CAMERA = PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3)
LENS = Lens.of_camera(CAMERA)
HERE = Pose2(x_m=1.0, y_m=2.0, heading_rad=0.5)
CENTRE = np.array([[319.5, 239.5]])


def add(
    panorama: Panorama,
    pan_rad: float,
    place: Pose2 = HERE,
    du_px: float = 0.0,
    sigma_px: float = 0.1,
) -> bool:
    return panorama.add(
        CENTRE + np.array([du_px, 0.0]),
        np.array([sigma_px]),
        lens=LENS,
        joints=HeadAngles(turret_rad=0.2, pan_rad=pan_rad, tilt_rad=0.3),
        odometry=place,
    )


def test_two_spots_of_two_directions_make_a_panorama() -> None:
    panorama = Panorama(0.001)
    gained = [add(panorama, pan) for pan in (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)]
    assert gained == [False] * 3 + [True] * 3
    found = panorama.frequent_spots(5)
    assert found.turns_rad == pytest.approx([0.7, 1.7])
    assert found.tilts_rad == pytest.approx([0.3, 0.3])
    # At the centre of the image 1 mrad of the encoders is 0.554 px.
    assert found.sigmas_px == pytest.approx(np.hypot(0.1, 0.5543), abs=1e-3)


def test_a_spot_of_two_images_is_not_used() -> None:
    panorama = Panorama(0.001)
    for pan in (0.0, 0.0, 1.0, 1.0, 1.0):
        add(panorama, pan)
    assert len(panorama.frequent_spots(5).turns_rad) == 1


def test_spots_that_may_be_parts_of_walls_count_only_with_two_others() -> None:
    panorama = Panorama(0.001)
    for pan in (0.0, 1.0) * 3:
        add(panorama, pan, sigma_px=0.5)
    assert len(panorama.frequent_spots(5).turns_rad) == 0
    for _ in range(3):
        add(panorama, -1.0)
    assert len(panorama.frequent_spots(5).turns_rad) == 3
    unsure = np.hypot(0.5, 0.5543)
    assert panorama.frequent_spots(5).sigmas_px == pytest.approx(
        [unsure, unsure, np.hypot(0.1, 0.5543)], abs=1e-3
    )
    wider = panorama.frequent_spots(5, unsure_px=4.0)
    assert wider.sigmas_px == pytest.approx([4.0, 4.0, np.hypot(0.1, 0.5543)], abs=1e-3)


def test_spots_that_become_one_count_together() -> None:
    panorama = Panorama(0.001)
    for du_px in (0.0, 0.0, 8.0, 8.0, 4.0):  # half a degree is 5 px
        add(panorama, 0.0, du_px=du_px)
    add(panorama, 1.0)
    found = panorama.frequent_spots(5)
    assert found.pixels_px.tolist() == [[323.5, 239.5]]


def test_one_spot_at_two_angles_of_the_head_is_one() -> None:
    panorama = Panorama(0.001)
    add(panorama, 0.0)
    add(panorama, 0.0)
    # Turned 0.1 rad to the left, the light is 0.1 rad to the right of the (tilted) axis:
    # tan(0.1) cos(0.3) f = 53.1 px and a little lower, well within half a degree.
    add(panorama, 0.1, du_px=53.1)
    found = panorama.frequent_spots(5)
    assert found.turns_rad == pytest.approx([0.8])
    # There 1 mrad of the encoders is 1 + (53.1 / 554)^2 times as much as at the centre.
    assert found.sigmas_px == pytest.approx([math.hypot(0.1, 0.5543 * 1.00918)], abs=1e-3)


def test_driving_discards_the_panorama_and_steering_does_not() -> None:
    panorama = Panorama(0.001)
    add(panorama, 0.0)
    add(panorama, 0.0)
    add(panorama, -0.4, Pose2(x_m=1.0, y_m=2.0, heading_rad=0.9))
    assert len(panorama.frequent_spots(5).turns_rad) == 1
    add(panorama, 0.0, Pose2(x_m=1.02, y_m=2.0, heading_rad=0.5))
    assert len(panorama.frequent_spots(5).turns_rad) == 0


def test_the_most_frequent_spots_come_first_up_to_a_count() -> None:
    panorama = Panorama(0.001)
    for pan, times in ((0.0, 3), (0.5, 5), (1.0, 4)):
        for _ in range(times):
            add(panorama, pan)
    assert panorama.frequent_spots(2).turns_rad == pytest.approx([1.2, 1.7])
    panorama.clear()
    assert len(panorama.frequent_spots(2).turns_rad) == 0


def test_the_distance_of_the_filter_from_a_pose() -> None:
    config, none = LocalizerConfig(), np.empty(0, np.intp)
    noise, leds_m = config.noise, config.landmark_array_m
    state = PoseFilter(config.filter, noise, leds_m=leds_m, camera_height_m=1.1, calibrate=True)
    state.start(Pose2(x_m=1.0, y_m=2.0, heading_rad=3.0), np.diag([0.04, 0.01, 0.0004]))
    fix = Fix(1.2, 1.9, 3.35 - math.tau, 0.0, np.diag([25.0, 50.0, 1e4]), none, none)
    joints = HeadAngles(turret_rad=0.2, pan_rad=0.1, tilt_rad=0.3)
    angle2 = 0.0004 + 1e-4 + noise.pan_tilt_bias_rad**2 + noise.pan_tilt_noise_rad**2
    expected = 0.2**2 / (0.04 + 0.04) + 0.1**2 / (0.01 + 0.02) + 0.05**2 / angle2
    assert Acquisition(config, state, 0.7).distance2(fix, joints) == pytest.approx(expected)


def acquisition(pan_bias_rad: float = 0.0) -> Acquisition:
    config = LocalizerConfig()
    leds_m, known = config.landmark_array_m, {'camera_height_m': 1.1, 'calibrate': True}
    state = PoseFilter(config.filter, config.noise, leds_m=leds_m, **known)  # type: ignore[arg-type]
    state.mean[PAN_BIAS] = pan_bias_rad
    return Acquisition(config, state, 0.7)


def solve(
    into: Acquisition,
    led: int,
    here: Pose2,
    *,
    odometry: Pose2 = HERE,
    pan_bias_rad: float = 0.0,
    down_px: float = 0.0,
    sigma_px: float = 0.05,
) -> Pose2 | None:
    """Add an image of one LED, or of a light below it; return the pose of the panorama."""
    config = LocalizerConfig()
    led_m = config.landmark_array_m[[led]]
    pan_rad = math.atan2(led_m[0, 1] - here.y_m, led_m[0, 0] - here.x_m) - 0.5
    joints = HeadAngles(turret_rad=0.0, pan_rad=pan_rad, tilt_rad=0.2)
    true = replace(joints, pan_rad=pan_rad + pan_bias_rad)
    pixels_px = CAMERA.project(CameraMount(config.mount).points_in_camera(led_m, here, true))
    pixels_px[:, 1] += down_px
    spots = Spots.unknown(1)._replace(pixels_px=pixels_px, sigmas_px=np.array([sigma_px]))
    found = MatchedLeds(np.empty(0, np.intp), spots, pixels_px, 0)
    solved = into.from_panorama(found, joints, odometry, Optics(CAMERA))
    return None if solved is None else solved[0]


def test_a_lamp_beside_an_led_is_taken_for_it_where_nothing_else_fits() -> None:
    for sigma_px, fits in ((0.05, False), (0.5, True)):
        into = acquisition()
        for _ in range(3):
            solve(into, 0, HERE)
            solve(into, 1, HERE, down_px=10.0, sigma_px=sigma_px)
            pose = solve(into, 2, HERE)
        assert (pose is not None) == fits
    assert pose is not None
    assert math.hypot(pose.x_m - HERE.x_m, pose.y_m - HERE.y_m) < 0.05


BELOW_AN_LED = Pose2(x_m=1.7, y_m=0.65, heading_rad=0.5)


@pytest.mark.parametrize(('here', 'leds'), [(HERE, [0, 1, 2]), (BELOW_AN_LED, [0, 2])])
def test_leds_that_are_never_in_one_image_tell_the_pose(here: Pose2, leds: list[int]) -> None:
    into, odometry = acquisition(0.01), Pose2(x_m=5.0, y_m=6.0, heading_rad=0.4)
    for image in range(3 * len(leds)):
        led = leds[image % len(leds)]
        pose = solve(into, led, here, odometry=odometry, pan_bias_rad=0.01)
        assert (pose is None) == (image < 3 * len(leds) - 1)  # each is in three images
    assert pose is not None
    assert vars(pose) == pytest.approx(vars(here))
