"""Odometry that jumps; a camera that repeats its image while the robot moves."""

import math

import numpy as np
import pytest

from goalreach_msgs_py.values import HeadAngles, Pose2
from goalreach_perception.input_check import FrozenImageDetector, odometry_jump

HEAD = HeadAngles(turret_rad=0.0, pan_rad=0.0, tilt_rad=0.0)
LIT = np.random.default_rng(0).integers(0, 255, (48, 64), dtype=np.uint8)
DARK = np.full((48, 64), 16, dtype=np.uint8)


def at(y_m: float) -> Pose2:
    return Pose2(x_m=1.0, y_m=y_m, heading_rad=0.0)


def test_the_same_image_is_refused_once_the_robot_has_moved() -> None:
    camera = FrozenImageDetector()
    assert not camera.fault(LIT, HEAD, at(2.0))
    assert not camera.fault(LIT.copy(), HEAD, at(2.001))
    assert 'the same as before' in camera.fault(LIT.copy(), HEAD, at(2.02))
    other = LIT.copy()
    other[0, 0] += 1
    assert not camera.fault(other, HEAD, at(2.04))


def test_the_same_image_is_refused_once_the_head_has_turned() -> None:
    camera = FrozenImageDetector()
    camera.fault(LIT, HEAD, at(2.0))
    turned = HeadAngles(turret_rad=0.0, pan_rad=0.02, tilt_rad=0.0)
    assert camera.fault(LIT.copy(), turned, at(2.0))


@pytest.mark.parametrize('shape', [(200, 64), (20, 64), (48, 32)])
def test_an_image_of_another_size_is_another_image(shape: tuple[int, int]) -> None:
    camera = FrozenImageDetector()
    camera.fault(LIT, HEAD, at(2.0))
    assert not camera.fault(np.zeros(shape, np.uint8), HEAD, at(2.02))


def test_dark_images_without_noise_are_accepted() -> None:
    camera = FrozenImageDetector()
    camera.fault(DARK, HEAD, at(2.0))
    assert not camera.fault(DARK.copy(), HEAD, at(3.0))


@pytest.mark.parametrize(
    ('moved_m', 'turned_rad', 'jumps'),
    [
        *((0.055, 0.0, False), (0.057, 0.0, True)),  # 1.5 * 0.6 m/s * 0.04 s and 20 mm
        *((0.0, math.tau - 0.109, False), (0.0, -0.111, True)),  # 1.5 * 1 rad/s * 0.04 s and 0.05
    ],
)
def test_odometry_that_is_faster_than_the_robot(
    moved_m: float, turned_rad: float, *, jumps: bool
) -> None:
    now = Pose2(x_m=1.0 - 0.6 * moved_m, y_m=2.0 + 0.8 * moved_m, heading_rad=turned_rad)
    assert odometry_jump(at(2.0), now, 0.04, speed_m_per_s=0.6, turn_rad_per_s=1.0) == jumps
