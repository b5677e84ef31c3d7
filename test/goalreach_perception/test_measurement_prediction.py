from __future__ import annotations

import math

from hypothesis import assume, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_msgs_py.arena import ArenaConfig
from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.measurement_model import (
    HEADING,
    LEVEL,
    MOUNT,
    PAN_BIAS,
    SCALE,
    SLIP,
    TILT_BIAS,
    Lens,
    offset_derivatives,
    project,
    state_jacobian,
)
from goalreach_perception.measurement_prediction import (
    equivalent_gate,
    offsets_from,
    predict_leds,
    second_order_variances_px2,
)

LENS = Lens.of_camera(PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3))
LEDS_M = ArenaConfig().landmark_array_m


def test_offsets_are_positions_minus_the_camera() -> None:
    assert offsets_from([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 1.0, 1.0, 1.0) == [
        (0.0, 1.0, 2.0),
        (3.0, 4.0, 5.0),
    ]


@given(
    st.floats(0.3, 3.2),
    st.floats(0.6, 5.0),
    st.floats(-math.pi, math.pi),
    st.floats(-0.3, 0.8),
    st.floats(-0.01, 0.01),
)
@settings(max_examples=60, deadline=None)
def test_it_equals_the_measurement_model(
    x_m: float, y_m: float, azimuth: float, tilt: float, focal: float
) -> None:
    offsets = LEDS_M - np.array([x_m, y_m, 1.1])
    projection = project(offsets, optical_rotation(azimuth, tilt), LENS.scaled(focal))
    offsets_m, lens = offsets.tolist(), LENS.scaled(focal)
    expected = predict_leds(offsets_m, offsets_m, (azimuth, tilt), lens.intrinsics)
    assert expected.depth_m == pytest.approx(projection.depth_m.tolist())
    assume(min(expected.depth_m) > 0.1)
    assert expected.pixels_px == pytest.approx(projection.pixels_px, abs=1e-6)
    jacobian, by_head = expected.by_state, expected.by_head
    jacobian[:, SCALE] = 0.0
    assert jacobian == pytest.approx(
        _with_mount(state_jacobian(projection, offsets, offset_derivatives(3)), jacobian),
        rel=1e-9,
        abs=1e-7,
    )
    assert by_head == pytest.approx(jacobian[:, [PAN_BIAS, TILT_BIAS]])


def _with_mount(expected: FloatArray, found: FloatArray) -> FloatArray:
    """Return a jacobian with the columns of the mount, which the model of many cameras omits."""
    expected[:, MOUNT:SLIP] = found[:, MOUNT:SLIP]
    return expected


@given(st.floats(-2.5, -0.6), st.floats(-0.3, 0.8), st.floats(-0.1, 0.1))
@settings(max_examples=30, deadline=None)
def test_the_lens_off_the_axis(azimuth: float, tilt: float, left_m: float) -> None:
    offsets, axis, mount_m = LEDS_M - np.array([1.5, 2.5, 1.1]), (azimuth, tilt), (0.05, left_m)

    def pixels(axis: tuple[float, float], mount_m: tuple[float, float]) -> FloatArray:
        leds = offsets.tolist()
        return predict_leds(leds, leds, axis, LENS.intrinsics, mount_m).pixels_px.reshape(-1)

    found = predict_leds(offsets.tolist(), offsets.tolist(), axis, LENS.intrinsics, mount_m)
    assume(min(found.depth_m) > 0.3)
    rotation = optical_rotation(*axis)
    centre_m = mount_m[0] * rotation[2] - mount_m[1] * rotation[0]
    assert found.pixels_px == pytest.approx(
        project(offsets - centre_m, rotation, LENS).pixels_px, abs=1e-6
    )
    step = 1e-6
    columns = {
        HEADING: pixels((azimuth + step, tilt), mount_m) - pixels((azimuth - step, tilt), mount_m),
        TILT_BIAS: pixels((azimuth, tilt + step), mount_m)
        - pixels((azimuth, tilt - step), mount_m),
        MOUNT: pixels(axis, (0.05 + step, left_m)) - pixels(axis, (0.05 - step, left_m)),
        MOUNT + 1: pixels(axis, (0.05, left_m + step)) - pixels(axis, (0.05, left_m - step)),
    }
    for state, difference in columns.items():
        assert found.by_state[:, state] == pytest.approx(
            difference / (2 * step), rel=1e-4, abs=0.01
        )


def test_heading_level_and_scale_are_linearized_at_the_first_estimates() -> None:
    offsets = LEDS_M - np.array([1.5, 2.5, 1.1])
    first = offsets + np.array([0.01, -0.02, 0.03])
    now = predict_leds(offsets.tolist(), offsets.tolist(), (-1.6, 0.2), LENS.intrinsics)
    later = predict_leds(offsets.tolist(), first.tolist(), (-1.6, 0.2), LENS.intrinsics)
    then = later.by_state
    turns = now.by_state - then
    changed = np.flatnonzero(np.abs(turns).max(axis=0)).tolist()
    assert changed == [HEADING, PAN_BIAS, SCALE, 23 + LEVEL, 24 + LEVEL]
    assert later.by_head == pytest.approx(now.by_head)
    # A rotation about the point below the camera moves no pixel: u_x (-y) + u_y x + turn = 0.
    for led in range(3):
        x, y, _ = first[led]
        rows = then[2 * led : 2 * led + 2]
        column = 9 + 3 * led
        turned = -y * rows[:, column] + x * rows[:, column + 1] + rows[:, HEADING]
        assert turned == pytest.approx([0.0, 0.0], abs=1e-9)
        # Nor does a change of size of all of it: the offset grows, and the odometry's scale too.
        grown = rows[:, column : column + 3] @ first[led] + rows[:, SCALE]
        assert grown == pytest.approx([0.0, 0.0], abs=1e-9)


def test_what_linearization_neglects() -> None:
    # 500 px * 0.0016 m^2 / (2 * 2 m * 2 m) = 0.1 px; 0.5 px of the encoders * sqrt(0.002) m / 2 m.
    found = second_order_variances_px2([2.0, 1.0], 500.0, (0.0016, 0.0004), encoder_sigma_rad=1e-3)
    assert found == pytest.approx([0.010125, 0.010125, 0.1605, 0.1605])


def test_a_gate_of_more_numbers_is_exceeded_as_rarely() -> None:
    # Exceeded with p = 0.01 (tables of chi-square).
    assert equivalent_gate(11.345, 3, 6) == pytest.approx(16.812, rel=0.002)
    assert equivalent_gate(16.812, 6, 12) == pytest.approx(26.217, rel=0.002)
    assert equivalent_gate(11.345, 3, 3) == equivalent_gate(11.345, 3, 2) == 11.345
