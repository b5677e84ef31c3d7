from __future__ import annotations

import math

import numpy as np
import pytest

from goalreach_msgs_py.camera import PinholeCamera
from goalreach_msgs_py.values import HeadAngles, Pose2
from goalreach_perception.acquisition import Panorama
from goalreach_perception.measurement_model import Lens

LENS = Lens.of_camera(PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3))
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


def test_one_spot_at_two_angles_of_the_head_is_one() -> None:
    panorama = Panorama(0.001)
    add(panorama, 0.0)
    add(panorama, 0.0)
    # Turned 0.1 rad to the left, the light is 0.1 rad to the right of the (tilted) axis:
    # tan(0.1) cos(0.3) f = 53.1 px and a little lower, well within half a degree.
    add(panorama, 0.1, du_px=53.1)
    assert len(panorama.frequent_spots(5).turns_rad) == 1


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
