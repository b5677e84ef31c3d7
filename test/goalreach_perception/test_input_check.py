"""A camera that repeats its image while the robot moves."""

import numpy as np

from goalreach_msgs_py.values import HeadAngles, Pose2
from goalreach_perception.input_check import FrozenImageDetector

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


def test_dark_images_without_noise_are_accepted() -> None:
    camera = FrozenImageDetector()
    camera.fault(DARK, HEAD, at(2.0))
    assert not camera.fault(DARK.copy(), HEAD, at(3.0))
