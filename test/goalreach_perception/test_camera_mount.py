from __future__ import annotations

import math

import cv2
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_msgs_py.values import FloatArray, HeadAngles, Pose2
from goalreach_perception.measurement_model import CameraMount, Optics

CAMERA = PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3)
OPTICAL = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""From a frame with x forward, y left, z up to an optical frame."""


def _turn(axis: tuple[float, float, float], angle_rad: float) -> FloatArray:
    return np.asarray(cv2.Rodrigues(angle_rad * np.array(axis))[0], np.float64)


@given(
    *([st.floats(-0.6, 0.6)] * 2),
    st.floats(-3.0, 3.0),
    st.floats(-0.5, 0.5),
    st.floats(-1.0, 1.0),
)
@settings(max_examples=50, deadline=None)
def test_a_turned_camera_sees_what_one_on_the_axis_with_roll_sees(
    roll: float, pitch: float, yaw: float, tilt: float, pan: float
) -> None:
    mount = CameraMount((0.0, 0.0, 1.1, roll, pitch, yaw))
    joints, left_up = mount.look(HeadAngles(turret_rad=0.3, pan_rad=pan, tilt_rad=tilt))
    head = _turn((0, 0, 1), 0.3 + pan) @ _turn((0, 1, 0), -tilt)
    fixed = _turn((0, 0, 1), yaw) @ _turn((0, 1, 0), pitch) @ _turn((1, 0, 0), roll)
    to_camera = OPTICAL @ (head @ fixed).T
    point = to_camera.T @ np.array([0.2, -0.1, 1.0])
    level = optical_rotation(joints.turret_rad + joints.pan_rad, joints.tilt_rad)
    optics = Optics(CAMERA, left_up)
    seen_px, expected_px = (CAMERA.project((r @ point)[None]) for r in (to_camera, level))
    assert optics.undistort(seen_px) == pytest.approx(expected_px, abs=1e-6)
    assert optics.distort(expected_px) == pytest.approx(seen_px, abs=1e-6)


@pytest.mark.parametrize(
    ('tilt', 'attitude'),
    [(0.0, (0.2, -0.3, 1.2)), (0.4, (0.0, 0.0, 0.0)), (-0.2, (0.3, 0.0, 0.0))],
)
def test_points_as_a_camera_beside_the_axis_has_them(
    tilt: float, attitude: tuple[float, float, float]
) -> None:
    x, y, z = 0.07, -0.04, 0.9
    roll, pitch, yaw = attitude
    pose = Pose2(x_m=1.0, y_m=2.0, heading_rad=0.8)
    head = _turn((0, 0, 1), 0.8 + 0.3 - 0.1) @ _turn((0, 1, 0), -tilt)
    fixed = _turn((0, 0, 1), yaw) @ _turn((0, 1, 0), pitch) @ _turn((1, 0, 0), roll)
    centre = np.array([1.0, 2.0, z]) + head @ np.array([x, y, 0.0])
    point = np.array([[3.0, 2.5, 1.4]])
    expected = (point - centre) @ (head @ fixed) @ OPTICAL.T
    joints = HeadAngles(turret_rad=0.3, pan_rad=-0.1, tilt_rad=tilt)
    mount = CameraMount((x, y, z, roll, pitch, yaw))
    assert mount.points_in_camera(point, pose, joints) == pytest.approx(expected)


def test_the_optical_centre_of_a_camera_that_looks_left_and_up() -> None:
    mount = CameraMount((0.1, 0.02, 0.8, 0.0, -0.2, math.pi / 2))
    forward, left = mount.offset_m
    assert forward * math.cos(0.2) == pytest.approx(0.02)
    assert left == pytest.approx(-0.1)
    assert mount.height_m + forward * math.sin(0.2) == pytest.approx(0.8)


def test_a_level_camera_on_the_axis_changes_nothing() -> None:
    mount = CameraMount((0.05, -0.02, 1.1, 0.0, 0.0, 0.0))
    joints = HeadAngles(turret_rad=1.0, pan_rad=0.5, tilt_rad=0.2)
    assert mount.look(joints)[0] is joints
    assert (mount.offset_m, mount.height_m) == ((0.05, -0.02), 1.1)
