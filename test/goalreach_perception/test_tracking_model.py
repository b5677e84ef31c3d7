from __future__ import annotations

import math

from hypothesis import assume, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.camera import PinholeCamera, optical_rotation
from goalreach_perception.measurement_model import (
    Lens,
    offset_derivatives,
    project,
    state_jacobian,
)
from goalreach_perception.tracking_model import View, led_jacobian, led_pixels, offsets_from

LENS = Lens.of_camera(PinholeCamera.from_field_of_view(horizontal_fov_rad=math.pi / 3))
LEDS_M = Arena().landmark_array_m


def test_offsets_are_places_less_the_camera() -> None:
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
def test_it_is_the_measurement_model(
    x_m: float, y_m: float, azimuth: float, tilt: float, focal: float
) -> None:
    offsets = LEDS_M - np.array([x_m, y_m, 1.1])
    projection = project(offsets, optical_rotation(azimuth, tilt), LENS.scaled(focal))
    view = View(azimuth, tilt, LENS, focal)
    pixels, depths = led_pixels(offsets.tolist(), view)
    assert depths == pytest.approx(projection.depth_m.tolist())
    assume(min(depths) > 0.1)
    assert pixels == pytest.approx(projection.pixels_px, abs=1e-6)
    assert led_jacobian(offsets.tolist(), view) == pytest.approx(
        state_jacobian(projection, offsets, offset_derivatives(3)), rel=1e-9, abs=1e-7
    )
