from __future__ import annotations

from dataclasses import replace
import math

from hypothesis import assume, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_model import (
    FOCAL,
    HEADING,
    HEIGHT,
    LEDS,
    LEVEL,
    MOUNT,
    PAN_BIAS,
    TILT_BIAS,
    Lens,
    Optics,
    offset_derivatives,
    project,
    state_jacobian,
)

CAMERA = PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3)
LENS = Lens.of_camera(CAMERA)
LED_PLACES = np.array([[0.0, 0.0, 1.5], [1.0, 0.0, 1.0], [2.0, 0.5, 1.25]])


def pixels(state: FloatArray) -> FloatArray:
    azimuth = state[HEADING] + state[PAN_BIAS]
    centre = np.array([state[0], state[1], 1.0 + state[HEIGHT]])
    rotation = optical_rotation(azimuth, state[TILT_BIAS])
    offsets = state[LEDS:MOUNT].reshape(-1, 3) - centre
    offsets -= np.cross([*state[LEVEL:], 0.0], offsets)  # a base that turns by w
    return project(offsets, rotation, LENS.scaled(state[FOCAL])).pixels_px.reshape(-1)


def test_pixels_of_a_camera_that_faces_the_goal_wall() -> None:
    # Focal length 320 / tan(30 deg) = 554.2563 px, principal point (319.5, 239.5).
    # From (1, 2, 1) facing -y, the right-hand side is -x. LED 0 is 1 m right, 0.5 m up, 2 m
    # ahead: u = 319.5 + 554.2563 / 2, v = 239.5 - 554.2563 / 4. LED 1 is straight ahead. LED 2
    # is 1 m left, 0.25 m up, 1.5 m ahead.
    offsets = LED_PLACES - np.array([1.0, 2.0, 1.0])
    found = project(offsets, optical_rotation(-math.pi / 2, 0.0), LENS)
    assert found.pixels_px == pytest.approx(
        np.array([[596.6281, 100.9359], [319.5, 239.5], [-50.0042, 147.1240]]), abs=1e-3
    )
    assert found.depth_m == pytest.approx([2.0, 2.0, 1.5])


def test_a_point_behind_the_camera_has_the_minimum_depth() -> None:
    found = project(np.array([[0.0, 1.0, 0.0]]), optical_rotation(-math.pi / 2, 0.0), LENS)
    assert found.depth_m[0] == pytest.approx(0.05)


@given(
    st.floats(0.5, 3.0),
    st.floats(1.5, 5.0),
    st.floats(-2.2, -0.9),
    st.floats(-0.2, 0.6),
    st.floats(-0.01, 0.01),
)
@settings(max_examples=40, deadline=None)
def test_the_jacobian_is_the_derivative(
    x_m: float, y_m: float, heading: float, tilt: float, focal: float
) -> None:
    state = np.zeros(LEDS + 14)
    state[[0, 1, HEADING, TILT_BIAS, FOCAL]] = x_m, y_m, heading, tilt, focal
    state[LEDS:MOUNT] = LED_PLACES.reshape(-1)
    offsets = LED_PLACES - np.array([x_m, y_m, 1.0])
    projection = project(offsets, optical_rotation(heading, tilt), LENS.scaled(focal))
    assume((projection.depth_m > 0.3).all())
    jacobian = state_jacobian(projection, offsets, offset_derivatives(3))
    step = 1e-6
    for column in range(len(state)):
        change = np.zeros_like(state)
        change[column] = step
        numeric = (pixels(state + change) - pixels(state - change)) / (2.0 * step)
        # The derivative by the relative focal error is that of a lens longer by that part.
        scale = 1.0 + focal if column == FOCAL else 1.0
        assert jacobian[:, column] / scale == pytest.approx(numeric, rel=1e-5, abs=1e-3)


def test_batches_equal_single_views() -> None:
    offsets = np.stack([LED_PLACES - [1.0, 2.0, 1.0], LED_PLACES - [1.5, 3.0, 1.0]])
    rotations = np.stack([optical_rotation(-1.5, 0.1), optical_rotation(-1.4, 0.2)])
    together = project(offsets, rotations, LENS)
    derivatives = np.stack([offset_derivatives(3)] * 2)
    jacobians = state_jacobian(together, offsets, derivatives)
    for index in range(2):
        alone = project(offsets[index], rotations[index], LENS)
        assert together.pixels_px[index] == pytest.approx(alone.pixels_px)
        jacobian = state_jacobian(alone, offsets[index], offset_derivatives(3))
        assert jacobians[index] == pytest.approx(jacobian)


@pytest.mark.parametrize(
    ('model', 'terms'),
    [
        ('plumb_bob', (-0.3, 0.1, 0.001, -0.002, -0.01)),
        ('rational_polynomial', (1.2, 0.3, 0.001, -0.002, 0.01, 1.5, 0.5, 0.05)),
        ('equidistant', (-0.02, 0.01, -0.004, 0.001)),
    ],
)
def test_a_distortion_is_inverted_up_to_the_corners(model: str, terms: tuple[float, ...]) -> None:
    camera = replace(
        PinholeCamera.from_field_of_view(horizontal_fov_rad=math.radians(60)),
        distortion=terms,
        distortion_model=model,
    )
    corners = np.array([[0.0, 0.0], [639.0, 0.0], [0.0, 479.0], [639.0, 479.0], [320.0, 240.0]])
    optics = Optics(camera)
    ideal = optics.undistort(corners)
    assert np.abs(ideal - corners)[:4].max() > 10.0
    assert optics.distort(ideal) == pytest.approx(corners, abs=1e-3)
