"""The camera model, pinned by pixels computed by hand.

The arithmetic beside each case uses nothing but similar triangles, so that a sign error shared
by simulator and localizer cannot hide here.
"""

from dataclasses import replace
import math
from typing import Any

import cv2
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_msgs_py.camera import (
    PinholeCamera,
    camera_azimuth,
    optical_rotation,
)
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.values import HeadAngles

FACING_GOAL_WALL = -math.pi / 2


@pytest.fixture(name='camera')
def _camera() -> PinholeCamera:
    """Return a camera whose focal length is 500 px and whose centre is (319.5, 239.5)."""
    return PinholeCamera(fx_px=500.0, fy_px=500.0, cx_px=319.5, cy_px=239.5)


def pixel(
    camera: PinholeCamera, point: list[float], *, azimuth: float, tilt: float
) -> list[float]:
    offsets = np.array([point]) - (1.0, 2.0, 1.1)
    in_camera = offsets @ optical_rotation(azimuth, tilt).T
    return [float(value) for value in camera.project(in_camera)[0]]


def test_sixty_degrees_give_the_known_focal_length() -> None:
    camera = PinholeCamera.from_field_of_view(horizontal_fov_rad=math.radians(60))
    assert camera.fx_px == pytest.approx(320 * math.sqrt(3))  # 320 / tan 30 deg
    assert (camera.cx_px, camera.cy_px) == (319.5, 239.5)


def test_point_on_the_axis_is_the_principal_point(camera: PinholeCamera) -> None:
    straight_ahead = [1.0, 0.0, 1.1]
    assert pixel(camera, straight_ahead, azimuth=FACING_GOAL_WALL, tilt=0.0) == pytest.approx(
        [319.5, 239.5]
    )


def test_larger_x_is_left_when_facing_the_goal_wall(camera: PinholeCamera) -> None:
    # Facing -y, +x is on the left hand: 0.4 m at 2 m depth is 500 * 0.2 = 100 px to the left.
    assert pixel(camera, [1.4, 0.0, 1.1], azimuth=FACING_GOAL_WALL, tilt=0.0) == pytest.approx(
        [219.5, 239.5]
    )


def test_larger_y_is_left_when_facing_along_x(camera: PinholeCamera) -> None:
    # Facing +x, +y is on the left: 0.5 m at 5 m depth is 50 px.
    assert pixel(camera, [6.0, 2.5, 1.1], azimuth=0.0, tilt=0.0) == pytest.approx([269.5, 239.5])


def test_higher_point_is_up_in_the_image(camera: PinholeCamera) -> None:
    # 0.6 m above the lens at 2 m: 150 px up, and v counts down.
    assert pixel(camera, [1.0, 0.0, 1.7], azimuth=FACING_GOAL_WALL, tilt=0.0) == pytest.approx(
        [319.5, 89.5]
    )


def test_tilting_up_by_the_elevation_centres_the_point(camera: PinholeCamera) -> None:
    # 2 m away and 2 m up: elevation 45 deg.
    assert pixel(
        camera, [1.0, 0.0, 3.1], azimuth=FACING_GOAL_WALL, tilt=math.radians(45)
    ) == pytest.approx([319.5, 239.5])


def test_tilting_up_moves_a_level_point_down(camera: PinholeCamera) -> None:
    # A level point seen at 10 deg of tilt lies tan 10 deg * 500 px below the centre.
    expected = 239.5 + 500 * math.tan(math.radians(10))
    assert pixel(
        camera, [1.0, 0.0, 1.1], azimuth=FACING_GOAL_WALL, tilt=math.radians(10)
    ) == pytest.approx([319.5, expected])


def test_turning_left_moves_the_point_right(camera: PinholeCamera) -> None:
    turned = FACING_GOAL_WALL + math.radians(10)
    expected = 319.5 + 500 * math.tan(math.radians(10))
    assert pixel(camera, [1.0, 0.0, 1.1], azimuth=turned, tilt=0.0) == pytest.approx(
        [expected, 239.5]
    )


def test_point_behind_is_not_seen(camera: PinholeCamera) -> None:
    assert np.isnan(pixel(camera, [1.0, 4.0, 1.1], azimuth=FACING_GOAL_WALL, tilt=0.0)).all()


def test_radial_distortion_follows_brown_conrady() -> None:
    camera = PinholeCamera(
        fx_px=500.0, fy_px=500.0, cx_px=0.0, cy_px=0.0, distortion=(0.1, 0.0, 0.0, 0.0, 0.0)
    )
    # x = y = 0.5: r^2 = 0.5, factor 1 + 0.1 * 0.5 = 1.05, so 500 * 0.5 * 1.05 = 262.5.
    assert camera.project(np.array([[1.0, 1.0, 2.0]]))[0] == pytest.approx([262.5, 262.5])


def test_an_equidistant_lens_maps_angles_to_distances() -> None:
    camera = PinholeCamera(
        fx_px=400.0,
        fy_px=400.0,
        cx_px=0.0,
        cy_px=0.0,
        distortion=(0.0, 0.0, 0.0, 0.0),
        distortion_model='equidistant',
    )
    assert camera.is_distorted
    pixels = camera.project(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, -1.0, 1.0]]))
    expected = [[0.0, 0.0], [100.0 * math.pi, 0.0], [0.0, -100.0 * math.pi]]  # 45 degrees
    assert pixels == pytest.approx(np.array(expected))


def test_a_lens_shows_nothing_beyond_where_its_polynomial_turns_back() -> None:
    known: dict[str, Any] = {'fx_px': 500.0, 'fy_px': 500.0, 'cx_px': 320.0, 'cy_px': 240.0}
    camera = PinholeCamera(**known, distortion=(-0.3, 0.0, 0.0, 0.0, 0.0))  # r - 0.3 r^3
    assert camera.widest == pytest.approx(1.0 / math.sqrt(0.9), abs=0.01)
    points = np.array([[1.0, 0.0, 1.0], [0.0, 1.1, 1.0], [-1.5, 0.0, 1.0]])
    assert np.isnan(camera.project(points)).all(axis=1).tolist() == [False, True, True]
    assert [math.isnan(camera.project_point(*p)[0]) for p in points] == [False, True, True]
    assert PinholeCamera(**known, distortion=(0.1, 0.0, 0.1, 0.1, 0.0)).widest == math.inf


@pytest.mark.parametrize(
    ('model', 'terms'),
    [
        ('rational_polynomial', (1.2, -0.3, 0.01, -0.02, 0.05, 1.4, -0.1, 0.2)),
        ('equidistant', (-0.02, 0.01, -0.004, 0.001)),
    ],
)
def test_projections_agree_with_opencv(model: str, terms: tuple[float, ...]) -> None:
    camera = PinholeCamera(
        fx_px=500.0,
        fy_px=510.0,
        cx_px=320.0,
        cy_px=235.0,
        distortion=terms,
        distortion_model=model,
    )
    points = np.random.default_rng(0).uniform((-0.8, -0.8, 1.0), (0.8, 0.8, 3.0), (50, 3))
    matrix, zero = (
        np.array([[500.0, 0.0, 320.0], [0.0, 510.0, 235.0], [0.0, 0.0, 1.0]]),
        np.zeros(3),
    )
    opencv = cv2.fisheye if model == 'equidistant' else cv2
    expected = opencv.projectPoints(points[:, None], zero, zero, matrix, np.array(terms))[0]
    assert camera.project(points) == pytest.approx(expected[:, 0], abs=1e-6)
    assert camera.project_point(*points[0]) == pytest.approx(expected[0, 0], abs=1e-6)


@pytest.mark.parametrize(
    ('model', 'terms'),
    [('plumb_bob', 4), ('rational_polynomial', 5), ('equidistant', 5), ('x', 5)],
)
def test_terms_must_fit_the_model(model: str, terms: int) -> None:
    with pytest.raises(ConfigurationError, match='distortion'):
        PinholeCamera(
            fx_px=1.0,
            fy_px=1.0,
            cx_px=0.0,
            cy_px=0.0,
            distortion=(0.1,) * terms,
            distortion_model=model,
        )


def test_tangential_distortion_follows_brown_conrady() -> None:
    camera = PinholeCamera(
        fx_px=100.0, fy_px=100.0, cx_px=0.0, cy_px=0.0, distortion=(0.0, 0.0, 0.1, 0.2, 0.0)
    )
    # x = 0.5, y = 0, r^2 = 0.25: dx = p2 (r^2 + 2 x^2) = 0.15, dy = p1 r^2 = 0.025.
    assert camera.project(np.array([[0.5, 0.0, 1.0]]))[0] == pytest.approx([65.0, 2.5])


def test_azimuth_is_the_sum_of_the_axes() -> None:
    head = HeadAngles(turret_rad=0.5, pan_rad=-0.2, tilt_rad=0.1)
    assert camera_azimuth(1.0, head) == pytest.approx(1.3)


def test_rotation_is_a_rotation() -> None:
    rotation = optical_rotation(0.7, -0.3)
    assert rotation @ rotation.T == pytest.approx(np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_refuses_a_camera_without_focal_length() -> None:
    with pytest.raises(ConfigurationError, match=r'fx_px = 0\.0'):
        PinholeCamera(fx_px=0.0, fy_px=1.0, cx_px=0.0, cy_px=0.0)


@given(
    st.floats(-3, 3),
    st.floats(-3, 3),
    st.floats(-2, 6).filter(lambda depth_m: depth_m < 0.0 or depth_m > 0.01),
    st.sampled_from([(0.0, 0.0, 0.0, 0.0, 0.0), (-0.2, 0.05, 1e-3, -2e-3, 0.01)]),
)
def test_one_point_is_projected_as_many_are(
    x_m: float, y_m: float, z_m: float, distortion: tuple[float, float, float, float, float]
) -> None:
    camera = replace(
        PinholeCamera.from_field_of_view(horizontal_fov_rad=1.0), distortion=distortion
    )
    expected = camera.project(np.array([[x_m, y_m, z_m]]))[0]
    found = camera.project_point(x_m, y_m, z_m)
    assert np.allclose(found, expected, rtol=1e-12, atol=1e-9, equal_nan=True)
