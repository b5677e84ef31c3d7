import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_msgs_py.values import Pose2
from goalreach_sim.path_integral import Motion
from goalreach_sim.sensors import (
    BUMPER_COUNT,
    RunErrors,
    WheelOdometry,
    draw_run_errors,
    pressed_bumpers,
)


def test_scale_error_stretches_the_path() -> None:
    odometry = WheelOdometry(1.1)
    odometry.define(Pose2(x_m=1.0, y_m=2.0, heading_rad=math.pi / 2), 0.3)
    odometry.count(Motion(0.3, 0.0, 0.0, 0.5, 0.0), 2.0)
    pose = odometry.pose(0.3)
    assert pose.x_m == pytest.approx(1.0, abs=1e-15)
    assert pose.y_m == pytest.approx(3.1, abs=1e-15)
    assert pose.heading_rad == pytest.approx(math.pi / 2, abs=1e-15)


def test_heading_follows_the_steering() -> None:
    odometry = WheelOdometry(1.0)
    odometry.define(Pose2(x_m=0.0, y_m=0.0, heading_rad=3.0), 1.0)
    assert odometry.pose(1.5).heading_rad == pytest.approx(3.5 - 2 * math.pi, abs=1e-15)


def pressed(directions_deg: list[float], base_yaw_deg: float) -> list[int]:
    flags = pressed_bumpers([math.radians(d) for d in directions_deg], math.radians(base_yaw_deg))
    assert len(flags) == BUMPER_COUNT == 20
    return [index for index, flag in enumerate(flags) if flag]


def test_no_contact_presses_no_bumper() -> None:
    assert pressed([], 12.0) == []


def test_between_two_sensors_both_are_pressed() -> None:
    assert pressed([9.0], 0.0) == [0, 1]
    assert pressed([185.0], 0.0) == [10, 11]


def test_contact_at_a_sensor_presses_its_neighbours_too() -> None:
    assert pressed([90.0], 0.0) == [4, 5, 6]
    assert pressed([0.0], 0.0) == [0, 1, 19]


def test_a_corner_presses_two_groups() -> None:
    assert pressed([185.0, -85.0], 0.0) == [10, 11, 15, 16]


def test_the_base_carries_the_sensors() -> None:
    # The wall at -90 deg, the base turned by -85 deg: seen at -5 deg from the base.
    assert pressed([-90.0], -85.0) == [0, 19]


@given(direction_deg=st.floats(-720.0, 720.0), yaw_deg=st.floats(-720.0, 720.0))
@settings(max_examples=100, deadline=None)
def test_every_direction_is_covered_by_two_or_three_neighbours(
    direction_deg: float, yaw_deg: float
) -> None:
    indices = pressed([direction_deg], yaw_deg)
    assert len(indices) in (2, 3)
    centre = math.radians(direction_deg - yaw_deg)
    for index in indices:
        assert math.cos(index * math.radians(18.0) - centre) >= math.cos(math.radians(18.001))


def draw(noise: NoiseModel, seed: int) -> RunErrors:
    return draw_run_errors(noise, 3, np.random.default_rng(seed))


def test_no_noise_draws_no_errors() -> None:
    errors = draw(noise_preset('none'), 1)
    assert not errors.landmark_offsets_m.any()
    assert (errors.focal_scale, errors.odometry_scale) == (1.0, 1.0)
    biases = (
        errors.pan_bias_rad,
        errors.tilt_bias_rad,
        errors.drift_rad_per_m,
        errors.camera_height_m,
    )
    assert biases == (0.0, 0.0, 0.0, 0.0)


def test_harsh_doubles_the_same_draw() -> None:
    nominal, harsh = draw(noise_preset('nominal'), 5), draw(noise_preset('harsh'), 5)
    assert harsh.pan_bias_rad == pytest.approx(2 * nominal.pan_bias_rad)
    assert harsh.odometry_scale - 1 == pytest.approx(2 * (nominal.odometry_scale - 1))
    assert harsh.landmark_offsets_m == pytest.approx(2 * nominal.landmark_offsets_m)


def test_spread_matches_the_model() -> None:
    noise = NoiseModel()
    runs = [draw(noise, seed) for seed in range(800)]
    spread = {
        'pan': (np.std([e.pan_bias_rad for e in runs]), noise.pan_tilt_bias_rad),
        'tilt': (np.std([e.tilt_bias_rad for e in runs]), noise.pan_tilt_bias_rad),
        'height': (np.std([e.camera_height_m for e in runs]), noise.camera_height_error_m),
        'focal': (np.std([e.focal_scale for e in runs]), noise.focal_error),
        'scale': (np.std([e.odometry_scale for e in runs]), noise.odometry_scale_error),
        'drift': (np.std([e.drift_rad_per_m for e in runs]), noise.odometry_drift_rad_per_m),
        'survey': (np.std([e.landmark_offsets_m for e in runs]), noise.survey_error_m),
    }
    for measured, told in spread.values():
        assert measured == pytest.approx(told, rel=0.1)
